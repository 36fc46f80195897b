"""Driver of the add-on inside Blender: addon_drive.py ARCHIVE ADDRESS PID RESULT README WALKS.

It installs the archive as an extension. It records the armatures' motion with the requested one for
later comparison, and messages and other effects as facts. PID is the service's process, which is
stopped at the end. WALKS: for each gait the model, a performer, and controls that walk straight.
"""

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import addon_motion
import addon_perform
import addon_trouble
import bpy
import numpy as np
from addon_layout import Layout, drawn
from addon_stage import (
    afresh,
    arrays,
    cases,
    empty,
    facts,
    install,
    part,
    preferences,
    record,
    service,
    slide,
)


def panel():
    empty()
    facts["drawn before"] = drawn()
    afresh("reaching")
    bpy.ops.posefield.import_clip()
    facts["drawn after"] = drawn()
    slide(stature=2.5)
    facts["drawn outside"] = drawn()
    bpy.ops.posefield.import_clip()
    facts["drawn from far outside"] = drawn()
    rows = []
    part("preferences").PosefieldPreferences.draw(
        SimpleNamespace(
            layout=Layout(rows),
            bl_rna=preferences().bl_rna,
            key="k",
            address=addon_trouble.ELSEWHERE,
        ),
        bpy.context,
    )
    facts["drawn preferences"] = rows
    found = bpy.context.scene.posefield_controls.bl_rna.properties["stature"]
    facts["slider"] = [
        round(getattr(found, name), 4) for name in ("soft_min", "soft_max", "hard_min", "hard_max")
    ]
    facts["slider words"] = [found.name, found.description]


def scripted(readme):
    empty()
    (code,) = re.findall(r"```python\n(.*?)```", Path(readme).read_text(), re.S)
    exec(code.replace("http://127.0.0.1:8000", service["address"]), {})
    record("the README's lines", {"controls": {"turn": 17.0}})


if __name__ == "__main__":
    archive, service["address"], pid, result, readme, walks = sys.argv[1:]
    install(archive)
    addon_motion.reaching()
    addon_motion.late()
    addon_motion.in_place_of_sliders()
    addon_motion.onto_existing()
    addon_motion.rates()
    for given in json.loads(walks):
        addon_motion.walking(*given)
    addon_motion.styles("styled")
    addon_motion.takes("stroll")
    addon_perform.performed(json.loads(walks)[-1][0], (1.2, 1.0))
    addon_trouble.undone()
    addon_trouble.refused()
    addon_trouble.another_model(*json.loads(walks)[0][:2])
    addon_trouble.unforeseen()
    addon_trouble.losses(Path(result).with_suffix(".blend"))
    panel()
    scripted(readme)
    addon_trouble.stopped(int(pid))
    addon_trouble.switched_off()
    np.savez(result, **arrays)
    Path(result).with_suffix(".json").write_text(json.dumps({"cases": cases, "facts": facts}))
