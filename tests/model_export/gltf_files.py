"""Small glTF files for tests: any nodes, skins and curves, with accessors of any kind."""

import json
import struct

import numpy as np

CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class GltfFile:
    """A document that is built part by part."""

    def __init__(self, nodes, skins=None):
        self.binary = b""
        self.facts = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": nodes,
            "accessors": [],
            "bufferViews": [],
            "animations": [],
        }
        if skins:
            self.facts["skins"] = skins

    def view(self, content, **parts):
        """Add a buffer view; return its index."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(content), **parts}
        self.binary += content
        self.facts["bufferViews"].append(view)
        return len(self.facts["bufferViews"]) - 1

    def accessor(self, values, kind="f4", normalized=False, **parts):
        """Add an accessor of values (count, width); return its index."""
        values = np.asarray(values, float).reshape(len(values), -1)
        if normalized:
            values = np.rint(values * np.iinfo(np.dtype(kind)).max)
        raw = values.astype(np.dtype(kind).newbyteorder("<"))
        own = {
            "componentType": CODES[kind],
            "count": len(values),
            "type": KINDS[values.shape[1]],
            "normalized": normalized,
            **parts,
        }
        if "sparse" not in parts:
            own["bufferView"] = self.view(raw.tobytes())
        self.facts["accessors"].append(own)
        return len(self.facts["accessors"]) - 1

    def animate(self, *curves, name="walk"):
        """Add an animation of curves (node, part, times, values, interpolation) or accessors."""
        channels, samplers = [], []
        for node, part, times, values, interpolation in curves:
            said = times if isinstance(times, int) else self.accessor(times)
            out = values if isinstance(values, int) else self.accessor(values)
            channels.append({"sampler": len(samplers), "target": {"node": node, "path": part}})
            samplers.append({"input": said, "output": out, "interpolation": interpolation})
        self.facts["animations"].append({"name": name, "channels": channels, "samplers": samplers})
        return self

    def text(self, uri=None):
        """Return the document as JSON; uri: of its buffer."""
        buffer = {"byteLength": len(self.binary)} | ({"uri": uri} if uri else {})
        return json.dumps({**self.facts, "buffers": [buffer]}).encode()

    def glb(self):
        """Return the document as GLB."""
        text = self.text()
        text += b" " * (-len(text) % 4)
        binary = self.binary + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def arm(**root):
    """Nodes of two joints, the second 1 m above the first, and a skin of them."""
    return [
        {"name": "upper", "children": [1], **root},
        {"name": "lower", "translation": [0.0, 1.0, 0.0]},
    ]
