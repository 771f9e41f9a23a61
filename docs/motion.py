"""Draws motion.svg: stick figures of clips that `gestus demo` has generated and stylized. Needs Python alone.

    cargo run --release --bin gestus -- demo
    python3 docs/motion.py gestus-demo docs/motion.svg
"""
import math
import sys

FIGURES, FIRST_S, STEP_S = 13, 1.5, 0.16
SPACING, LEFT, ROW, SCALE = 62, 96, 104, 0.5  # pixels; SCALE in pixels a centimetre
VIEW = math.radians(28)  # how far the camera stands in front of a body that walks to the right
PAIRS = [
    ("walk", [("neutral", "input"), ("proud", "proud"), ("proud-old", "proud + old")]),
    ("run", [("neutral", "input"), ("angry", "angry")]),
]


def read_bvh(path):
    """Joints (name, parent, offset, channels), rate and frames of a BVH file."""
    words = open(path).read().split()
    joints, stack, at = [], [], 0
    while words[at] != "MOTION":
        if words[at] in ("ROOT", "JOINT", "End"):
            joints.append([words[at + 1], stack[-1] if stack else -1, None, []])
            stack.append(len(joints) - 1)
        elif words[at] == "OFFSET":
            joints[stack[-1]][2] = [float(w) for w in words[at + 1 : at + 4]]
        elif words[at] == "CHANNELS":
            joints[stack[-1]][3] = words[at + 2 : at + 2 + int(words[at + 1])]
        elif words[at] == "}":
            stack.pop()
        at += 1
    count, step = int(words[at + 2]), float(words[at + 5])
    numbers = [float(w) for w in words[at + 6 :]]
    width = len(numbers) // count
    return joints, step, [numbers[i * width : (i + 1) * width] for i in range(count)]


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def apply(a, v):
    return [sum(a[i][k] * v[k] for k in range(3)) for i in range(3)]


def turn(axis, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return {"X": [[1, 0, 0], [0, c, -s], [0, s, c]], "Y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "Z": [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[axis]


def positions(joints, frame):
    """World positions of the joints, centimetres."""
    placed, at = [], 0
    for _, parent, offset, channels in joints:
        rotation, moved = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], list(offset)
        for channel in channels:
            if channel.endswith("position"):
                moved["XYZ".index(channel[0])] = frame[at]
            else:
                rotation = times(rotation, turn(channel[0], frame[at]))
            at += 1
        if parent >= 0:
            around, origin = placed[parent]
            moved = [o + m for o, m in zip(origin, apply(around, moved))]
            rotation = times(around, rotation)
        placed.append((rotation, moved))
    return [place for _, place in placed]


def draw(clip, x, floor):
    """One figure, the far limbs behind the near ones."""
    joints, _, frame = clip
    place = positions(joints, frame)
    names = {joint[0]: n for n, joint in enumerate(joints)}
    left, right = place[names["UpperLeg_L"]], place[names["UpperLeg_R"]]
    across = [left[0] - right[0], left[2] - right[2]]
    length = math.hypot(*across)
    ahead = [-across[1] / length, across[0] / length]
    across = [across[0] / length, across[1] / length]
    root = place[0]
    drawn = []
    for p in place:
        d = [p[0] - root[0], p[2] - root[2]]
        forward, side = d[0] * ahead[0] + d[1] * ahead[1], d[0] * across[0] + d[1] * across[1]
        drawn.append((x + SCALE * (forward * math.cos(VIEW) + side * math.sin(VIEW)), floor - SCALE * p[1]))
    layers = {"far": [], "body": [], "near": []}
    for n, (name, parent, _, _) in enumerate(joints):
        if parent < 0 or name == "Site":
            continue
        layer = "far" if name.endswith("_L") else "near" if name.endswith("_R") else "body"
        (x0, y0), (x1, y1) = drawn[parent], drawn[n]
        layers[layer].append(f"M{x0:.1f} {y0:.1f}L{x1:.1f} {y1:.1f}")
    head = drawn[names["Head"]]
    svg = "".join(f'<path class="{layer}" d="{"".join(lines)}"/>' for layer, lines in layers.items())
    return svg + f'<circle cx="{head[0]:.1f}" cy="{head[1] - 3:.1f}" r="5"/>'


def main(folder, out):
    rows, floor = [], 0
    for action, clips in PAIRS:
        floor += 8
        for style, label in clips:
            joints, step, frames = read_bvh(f"{folder}/{action}_{style}.bvh")
            floor += ROW
            kind = "input" if label == "input" else "output"
            title = action if label == "input" else label
            figures = "".join(
                draw((joints, step, frames[min(len(frames) - 1, round((FIRST_S + i * STEP_S) / step))]),
                     LEFT + SPACING * (i + 0.5), floor)
                for i in range(FIGURES)
            )
            rows.append(f'<g class="{kind}"><text x="8" y="{floor - 40}">{title}</text>{figures}</g>')
            rows.append(f'<path class="floor" d="M{LEFT} {floor + 2}H{LEFT + SPACING * FIGURES}"/>')
    width, height = LEFT + SPACING * FIGURES + 10, floor + 14
    style = (
        "text{font:14px sans-serif}path{fill:none;stroke-width:3;stroke-linecap:round}.far{opacity:.4}"
        ".input path{stroke:#6b7280}.input circle,.input text{fill:#6b7280}"
        ".output path{stroke:#c2410c}.output circle,.output text{fill:#c2410c}"
        ".floor{stroke:#d1d5db;stroke-width:1}"
    )
    with open(out, "w") as file:
        file.write(
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
            f"<style>{style}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n" + "\n".join(rows) + "\n</svg>\n"
        )


main(*sys.argv[1:3])
