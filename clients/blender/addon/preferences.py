"""Preferences: address, key and timeout, stored in Blender's preferences, not in scene files."""

import bpy
from bpy.props import FloatProperty, StringProperty

from .without_blender import faults
from .without_blender.service import Service


class PosefieldPreferences(bpy.types.AddonPreferences):
    """Address, key and timeout of the service."""

    bl_idname = __package__

    address: StringProperty(
        name="Service",
        description="Address of the posefield service",
        default="http://127.0.0.1:8000",
    )
    key: StringProperty(
        name="API key",
        description="Sent with every question, where the service asks for one",
        subtype="PASSWORD",
    )
    seconds: FloatProperty(
        name="Timeout",
        description="How long answers may take, s; an import waits that long for all together",
        default=5.0,
        min=0.1,
        soft_max=60.0,
    )

    def draw(self, _context):
        """Draw the settings, with warnings on the storage and transport of the key."""
        self.layout.prop(self, "address")
        self.layout.prop(self, "key")
        self.layout.prop(self, "seconds")
        if self.key:
            self.layout.label(
                text="The key is kept as plain text in Blender's preferences", icon="INFO"
            )
        if self.key and not _is_secret(self.address):
            self.layout.label(text="Without https others on the way can read the key", icon="ERROR")


def of(context) -> PosefieldPreferences:
    """Return the add-on's preferences."""
    return context.preferences.addons[__package__].preferences


def service(context) -> Service:
    """Return the service; raise BadAddress, or Offline if Blender may not access it."""
    own = of(context)
    found = Service(own.address, own.key, own.seconds)
    if not found.is_here and not bpy.app.online_access:
        raise faults.Offline(
            f"{own.address} is another machine, and Blender is set to stay offline:"
            " Preferences, System, Allow Online Access"
        )
    return found


def _is_secret(address: str) -> bool:
    try:
        return Service(address).is_secret
    except faults.BadAddress:
        return True


CLASSES = (PosefieldPreferences,)
