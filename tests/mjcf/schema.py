#!/usr/bin/env python3
"""Writes the elements and attributes of MJCF that MuJoCo states: host/model/src/robot/mjcf/schema.txt.

    python3 tests/mjcf/schema.py           # adds those of the installed MuJoCo to the file

A line is "parent/element: attributes". Bodies, frames, replicates and the world have the same elements: their parent is "body".
"""

import re
from pathlib import Path

import mujoco

TARGET = Path(__file__).parents[2] / "host/model/src/robot/mjcf/schema.txt"
LINE = re.compile(r"^( *)(\S+) +\((.)\) *(.*)$")
known = {}
if TARGET.exists():
    for line in TARGET.read_text().splitlines():
        key, _, names = line.partition(":")
        known[key] = set(names.split())


def add(parent, tag, names):
    known.setdefault(f"{parent}/{tag}", set()).update(names)


above, keys = [], []
for line in mujoco.mj_printSchema(False, False).splitlines():
    found = LINE.match(line)
    if not found:
        for key in keys:
            known[key].update(line.split())
        continue
    depth = len(found[1]) // 3
    tag = found[2].replace("(world)", "")
    parent = above[depth - 1] if depth else ""
    above[depth:] = [tag]
    names = found[4].split()
    places = [(parent, tag)]
    if tag == "body":
        places = [("body", tag), ("mujoco", "worldbody")]
    elif tag == "default":
        places = [(parent, tag), (tag, tag)]
    keys = [f"{p}/{t}" for p, t in places]
    for place in places:
        add(*place, names)
# The printed schema leaves out what the parser takes everywhere in a body.
add("body", "frame", "name pos quat axisangle xyaxes zaxis euler childclass".split())
TARGET.write_text("".join(f"{key}: {' '.join(sorted(names))}\n" for key, names in sorted(known.items())))
