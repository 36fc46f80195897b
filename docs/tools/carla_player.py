"""Plays a crowd of posefield on walkers of CARLA: python carla_player.py street.carla.npz [HOST].

Trunk and head turn as the model's do, and limbs point where the model's point, whatever proportions
and rest poses the walkers have. Needs walkers with bones `crl_*` (0.9.13 on)."""

import sys

import numpy as np

TRUNK = ("", "hips__C", "spine__C", "spine01__C", "neck__C", "Head__C")
PARENTS = dict(zip(TRUNK[1:], TRUNK, strict=False))
for side in ("__L", "__R"):
    PARENTS |= {f"shoulder{side}": "spine01__C", f"thigh{side}": "hips__C"}
    for limb in (("shoulder", "arm", "foreArm", "hand"), ("thigh", "leg", "foot", "toe")):
        PARENTS |= {limb[n + 1] + side: limb[n] + side for n in range(3)}
CHILDREN = {parent: bone for bone, parent in PARENTS.items() if not bone.endswith("__C")}
MIDDLE = np.array([0.0, 0.0, 0.93])  # Of a walker, where its origin is, m.


def turn(q):
    across = np.array([[0.0, -q[3], q[2]], [q[3], 0.0, -q[1]], [-q[2], q[1], 0.0]])
    return np.eye(3) + 2.0 * q[0] * across + 2.0 * across @ across


def swing(before, after):
    a, b = before / np.linalg.norm(before), after / np.linalg.norm(after)
    half = np.array([1.0 + a @ b, *np.cross(a, b)])
    return turn(half / max(np.linalg.norm(half), 1e-6))


def rotation(m):
    roll, pitch = np.arctan2(-m[2, 1], m[2, 2]), np.arcsin(np.clip(m[2, 0], -1, 1))
    return carla.Rotation(*np.degrees([pitch, np.arctan2(m[1, 0], m[0, 0]), roll]).tolist())


def pose(rest, bones, turns):
    placed, transforms = {"": np.eye(3)}, []
    bones, turns = (dict(zip(PARENTS, rows, strict=True)) for rows in (bones, turns))
    axes = {bone: np.array(rest[bone].component.get_matrix())[:3, :3] for bone in PARENTS}
    for bone, parent in PARENTS.items():
        if bone.endswith("__C"):
            placed[bone] = turn(turns[bone]) @ axes[bone]
        else:
            carried = placed[parent] @ axes[parent].T
            placed[bone] = carried @ axes[bone]
            if child := CHILDREN.get(bone):
                arm = rest[child].component.location - rest[bone].component.location
                arm = carried @ [arm.x, arm.y, arm.z]
                placed[bone] = swing(arm, bones[child] - bones[bone]) @ placed[bone]
        where = rest[bone].relative.location, rotation(placed[parent].T @ placed[bone])
        transforms.append((f"crl_{bone}", carla.Transform(*where)))
    return carla.WalkerBoneControlIn(transforms)


def main(path, host="localhost"):
    global carla
    import carla

    data, walkers, world = dict(np.load(path)), {}, carla.Client(host, 2000).get_world()
    order = [data["names"].tolist().index(f"crl_{bone}") for bone in PARENTS]
    bones, turns = data["bones"][:, order], data["turns"][:, order]
    kinds = world.get_blueprint_library().filter("walker.pedestrian.*")
    for time in np.unique(data["time"]):
        for row in np.flatnonzero(data["time"] == time).tolist():
            where = carla.Transform(carla.Location(*(data["location"][row] + MIDDLE).tolist()))
            where.rotation.yaw, person = float(np.degrees(data["yaw"][row])), data["person"][row]
            if person not in walkers:
                walker = world.spawn_actor(kinds[int(person) % len(kinds)], where)
                walker.set_simulate_physics(False)
                world.wait_for_tick()
                rest = walker.get_bones().bone_transforms
                walkers[person] = walker, {bone.name[4:]: bone for bone in rest}
            walker, rest = walkers[person]
            walker.set_transform(where)
            walker.set_bones(pose(rest, bones[row], turns[row]))
            walker.blend_pose(1.0)
        world.wait_for_tick()


print(__doc__) if {"-h", "--help"} & {*sys.argv} or not sys.argv[1:] else main(*sys.argv[1:])
