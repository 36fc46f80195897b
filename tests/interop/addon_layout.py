"""Stand-in for Blender's panel layout, since Blender draws no window in the background."""

from types import SimpleNamespace

import bpy


class Layout:
    """A layout that writes down what is drawn on it, and refuses what Blender's would.

    Blender draws no panel without a window.
    """

    icons = bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items.keys()

    def __init__(self, rows):
        self.rows = rows

    def row(self, **_):
        return Layout(self.rows)

    column = row

    def label(self, text="", icon="NONE"):
        assert icon in self.icons, icon
        self.rows.append(text)

    def prop(self, data, name, text=None, slider=False):
        found = data.bl_rna.properties[name]
        self.rows.append(found.name if text is None else text)

    def operator(self, name, text=None, icon="NONE"):
        assert icon in self.icons, icon
        found = getattr(bpy.ops.posefield, name.removeprefix("posefield.")).get_rna_type()
        self.rows.append(found.name if text is None else text)
        return SimpleNamespace()


def drawn():
    rows = []
    kind = bpy.types.Panel.bl_rna_get_subclass_py("VIEW3D_PT_posefield")
    kind.draw(SimpleNamespace(layout=Layout(rows)), bpy.context)
    return rows
