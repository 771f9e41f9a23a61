#!/usr/bin/env python3
"""Runs a stylized motion on the Unitree G1 in MuJoCo: what was asked, what was reached, whether it stood.

`gestus translate --robot g1.urdf --qpos motion.npy` says where the robot should be at each tick. Every hinge is a
position servo (PD) that is told its angle of the tick. Nothing balances the robot. See README.md.
"""
import argparse
import importlib.util
import json
import math
import pathlib
import sys
import tempfile
import xml.etree.ElementTree as xml

import mujoco
import numpy as np

# The robot has fallen when its pelvis is lower than this part of its height at first, or leans over more than this.
LOW, LEAN_DEG = 0.6, 50.0


def g1():
    """The folder of the G1 of the package `example-robot-data`, and its URDF."""
    for root in sys.path:
        robots = pathlib.Path(root, "cmeel.prefix/share/example-robot-data/robots/g1_description")
        if robots.is_dir():
            return robots / "urdf" / "g1_29dof_rev_1_0.urdf"
    raise SystemExit("the package example-robot-data is not installed: pip install -r requirements.txt")


def load(urdf, stiffness, damping_s, hang):
    """The robot on a floor: a free joint at its base, and a servo at every hinge. `hang`: its base is fixed in the air."""
    tree = xml.parse(urdf)
    # Meshes are seen and weigh nothing: the feet collide with their spheres, masses stand in the file.
    for link in tree.getroot().iter("link"):
        for name in ("visual", "collision"):
            for shape in link.findall(name):
                if shape.find("geometry/mesh") is not None:
                    link.remove(shape)
    options = xml.SubElement(tree.getroot(), "mujoco")
    xml.SubElement(options, "compiler", fusestatic="false", discardvisual="true", balanceinertia="true")
    spec = mujoco.MjSpec.from_string(xml.tostring(tree.getroot(), encoding="unicode"))
    base = spec.worldbody.first_body()
    if hang:
        base.pos = [0, 0, 2]
    else:
        base.add_freejoint()
    spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=[50, 50, 0.1], friction=[1.0, 0.02, 0.001], contype=1, conaffinity=1
    )
    for geom in spec.geoms:
        geom.friction = [1.0, 0.02, 0.001]
    limits = {
        joint.get("name"): float(joint.find("limit").get("effort"))
        for joint in tree.getroot().iter("joint")
        if joint.get("type") == "revolute"
    }
    for joint in spec.joints:
        if joint.type != mujoco.mjtJoint.mjJNT_HINGE:
            continue
        joint.armature = 0.03
        servo = spec.add_actuator(name=joint.name, target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        # By strength: an ankle of 50 N m is a third as stiff as a knee of 139.
        gain = stiffness * limits[joint.name] / 100.0
        servo.set_to_position(kp=gain, kv=damping_s * gain)
        servo.forcerange = [-limits[joint.name], limits[joint.name]]
        servo.forcelimited = True
    spec.option.timestep = 0.002
    return spec.compile()


def check(model, names, qpos):
    """The columns of the file are the model's joints, in its order; its feet stand on its floor."""
    hinges = [model.joint(j).name for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_HINGE]
    if names is not None and names[7:] != hinges:
        raise SystemExit(f"the file's joints are not the model's:\n{names[7:]}\n{hinges}")
    if qpos.shape[1] != model.nq:
        raise SystemExit(f"the file has {qpos.shape[1]} numbers a row, the model {model.nq}")
    # The floor is the world's. Any shape may be the lowest: feet have other names in every robot.
    shapes = [g for g in range(model.ngeom) if model.geom_bodyid[g] != 0]
    if not shapes:
        raise SystemExit("the shapes of this URDF are meshes alone, which do not collide here")
    data = mujoco.MjData(model)
    low = []
    for row in qpos:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        low.append(min(bottom(model, data, g) for g in shapes))
    if min(low) > 0.2:
        raise SystemExit(f"no shape comes nearer to the floor than {min(low):.2f} m: the feet of this URDF are meshes alone")
    return np.array(low)


def bottom(model, data, g):
    """Height of the lowest point of a shape, metres; of a cylinder, of the box around it."""
    kind, size, vertical = model.geom_type[g], model.geom_size[g], np.abs(data.geom_xmat[g][6:])
    if kind == mujoco.mjtGeom.mjGEOM_SPHERE:
        reach = size[0]
    elif kind == mujoco.mjtGeom.mjGEOM_CAPSULE:
        reach = size[0] + vertical[2] * size[1]
    else:
        reach = vertical @ model.geom_aabb[g][3:]
    return data.geom_xpos[g][2] - reach


def lean_deg(quaternion):
    """Angle between a body's Z and the world's."""
    _, x, y, _ = quaternion
    return np.degrees(np.arccos(np.clip(1 - 2 * (x * x + y * y), -1, 1)))


def run(model, qpos, tick_hz, hang, frames=None):
    """Drives the servos with the motion. Returns hinge angles at each tick, and when the robot fell, in seconds."""
    data = mujoco.MjData(model)
    # As many numbers as the model has: the free joint's seven are in front.
    data.qpos[:] = qpos[0][-model.nq :]
    mujoco.mj_forward(model, data)
    height, reached, fell = qpos[0][2], [], None
    # A tick takes whole steps, none longer than the model's.
    steps = math.ceil(1.0 / tick_hz / model.opt.timestep - 1e-6)
    model.opt.timestep = 1.0 / tick_hz / steps
    for tick, row in enumerate(qpos):
        data.ctrl[:] = row[7:]
        for _ in range(steps):
            mujoco.mj_step(model, data)
        reached.append(data.qpos[-model.nu :].copy())
        if frames is not None:
            frames.append(data.qpos.copy())
        if not hang and fell is None and (data.qpos[2] < LOW * height or lean_deg(data.qpos[3:7]) > LEAN_DEG):
            fell = (tick + 1) / tick_hz
            break
    return np.array(reached), fell


def rms_deg(reached, asked):
    """Root mean square of the error of each hinge, degrees."""
    return np.degrees(np.sqrt(np.mean((reached - asked[: len(reached)]) ** 2, axis=0)))


def draw(model, frames, path):
    """A row of pictures of the run, evenly spaced."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    data = mujoco.MjData(model)
    figure, axes = plt.subplots(figsize=(14, 4))
    chosen = np.linspace(0, len(frames) - 1, 12).astype(int)
    for place, f in enumerate(chosen):
        data.qpos[:] = frames[f]
        mujoco.mj_kinematics(model, data)
        for body in range(2, model.nbody):
            parent = model.body_parentid[body]
            if parent:
                points = data.xpos[[parent, body]] - [frames[f][0], 0, 0]
                name = model.body(body).name
                color = "tab:red" if "left" in name else "tab:blue" if "right" in name else "k"
                axes.plot(points[:, 0] + 0.9 * place, points[:, 2], color=color, lw=1.5)
    axes.axhline(0, color="gray")
    axes.set_aspect("equal")
    axes.set_title(f"{len(frames)} ticks; from the side, left red")
    figure.savefig(path, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("qpos", nargs="?", type=pathlib.Path, help="file of gestus translate --qpos, .npy or .csv")
    parser.add_argument("--urdf", type=pathlib.Path, help="another robot; default: the G1")
    parser.add_argument("--print-urdf", action="store_true", help="print the path of the G1's URDF, and end")
    parser.add_argument("--tick-hz", type=float, default=50.0, help="rows a second (tick_hz of the robot map)")
    parser.add_argument("--stiffness", type=float, default=800.0, help="N m/rad of a servo of 100 N m")
    parser.add_argument("--damping", type=float, default=0.03, help="damping over stiffness, seconds")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--picture", type=pathlib.Path, help="PNG of the free run (needs matplotlib)")
    args = parser.parse_args()
    urdf = args.urdf or g1()
    if args.print_urdf:
        print(urdf)
        return
    if args.qpos is None:
        parser.error("a file of gestus translate --qpos is needed")
    if not args.qpos.is_file():
        parser.error(f"{args.qpos}: there is no such file")
    if args.picture and not importlib.util.find_spec("matplotlib"):
        parser.error("--picture needs matplotlib: pip install matplotlib")
    names = None
    if args.qpos.suffix == ".csv":
        with open(args.qpos) as lines:
            names = next(lines).strip().split(",")
        if names[0] == "time_s":
            parser.error(f"{args.qpos}: this is a file of --csv; give one of gestus translate --qpos")
        qpos = np.loadtxt(args.qpos, delimiter=",", skiprows=1, ndmin=2)
    else:
        qpos = np.load(args.qpos)
    model = load(urdf, args.stiffness, args.damping, hang=False)
    soles = check(model, names, qpos)
    frames = [] if args.picture else None
    free, fell = run(model, qpos, args.tick_hz, hang=False, frames=frames)
    hung, _ = run(load(urdf, args.stiffness, args.damping, hang=True), qpos, args.tick_hz, hang=True)
    # A control: the pose of the first row, held as long.
    _, still_fell = run(model, np.repeat(qpos[:1], len(qpos), axis=0), args.tick_hz, hang=False)
    if frames:
        draw(model, frames, args.picture)
    seconds = len(qpos) / args.tick_hz
    joints = [model.joint(j).name for j in range(1, model.njnt)]
    hung_deg, free_deg = rms_deg(hung, qpos[:, 7:]), rms_deg(free, qpos[:, 7:])
    figures = {
        "robot": urdf.stem,
        "hinges": len(joints),
        "seconds": seconds,
        "asked_sole_cm": [100 * float(soles.min()), 100 * float(np.median(soles)), 100 * float(soles.max())],
        "hung_rms_deg": dict(zip(joints, hung_deg.tolist())),
        "free_rms_deg": dict(zip(joints, free_deg.tolist())),
        "hung_rms_all_deg": float(np.sqrt(np.mean(hung_deg**2))),
        "free_rms_all_deg": float(np.sqrt(np.mean(free_deg**2))),
        "stood": fell is None,
        "fell_s": fell,
        "still_fell_s": still_fell,
    }
    if args.json:
        print(json.dumps(figures))
        return
    asked = np.degrees(np.ptp(qpos[:, 7:], axis=0))
    print(f"{urdf.stem}: {len(joints)} hinges, {seconds:.1f} s at {args.tick_hz:g} ticks a second")
    low, middle, high = figures["asked_sole_cm"]
    print(f"asked: lowest sole {low:.1f} to {high:.1f} cm over the floor, median {middle:.1f}")
    print(f"{'hinge':28} asked, range   error hung   error free (rms, degrees)")
    for row in zip(joints, asked, hung_deg, free_deg):
        print("{:28} {:12.1f} {:12.2f} {:12.2f}".format(*row))
    print(f"{'all':28} {'':12} {figures['hung_rms_all_deg']:12.2f} {figures['free_rms_all_deg']:12.2f}")
    told = lambda fell: "stood to the end" if fell is None else f"fell after {fell:.2f} s"
    print(f"it {told(fell)}; told its first pose alone, it {told(still_fell)}")


if __name__ == "__main__":
    main()
