"""Writes straight-line C of an arm's dynamics, for tests/compare_generated.

    python3 tests/generated/generate.py ARM.txt ARM.c

ARM.txt is what `cargo bench --bench peer -- write FOLDER` writes. The C has no loop and no branch: lengths, twists and
inertial parameters are folded into it as numbers, terms with the factor 0 or 1 vanish, equal subexpressions are computed
once. Parameters are grouped beforehand (Gautier & Khalil 1990), as for the customised Newton-Euler of Khalil &
Kleinfinger (1987). Derivatives are the graph of the torques differentiated forwards, by each position and velocity.
"""

import math
import sys


class Graph:
    """Numbers, inputs and operations, each of them once."""

    def __init__(self):
        self.nodes = []
        self.known = {}

    def node(self, *content):
        if content not in self.known:
            self.known[content] = len(self.nodes)
            self.nodes.append(content)
        return Value(self, self.known[content])

    def number(self, x):
        return self.node("number", float(x))


class Value:
    """A node, with the operators of arithmetic."""

    def __init__(self, graph, index):
        self.graph, self.index = graph, index

    def content(self):
        return self.graph.nodes[self.index]

    def constant(self):
        kind, *rest = self.content()
        return rest[0] if kind == "number" else None

    def lifted(self, other):
        return other if isinstance(other, Value) else self.graph.number(other)

    def __neg__(self):
        if self.constant() is not None:
            return self.graph.number(-self.constant())
        if self.content()[0] == "-x":
            return Value(self.graph, self.content()[1])
        return self.graph.node("-x", self.index)

    def __add__(self, other):
        other = self.lifted(other)
        a, b = self.constant(), other.constant()
        if a is not None and b is not None:
            return self.graph.number(a + b)
        if a == 0.0:
            return other
        if b == 0.0:
            return self
        if other.content()[0] == "-x":
            return self - (-other)
        if self.content()[0] == "-x":
            return other - (-self)
        return self.graph.node("+", *sorted((self.index, other.index)))

    def __sub__(self, other):
        other = self.lifted(other)
        a, b = self.constant(), other.constant()
        if a is not None and b is not None:
            return self.graph.number(a - b)
        if b == 0.0:
            return self
        if a == 0.0:
            return -other
        if self.index == other.index:
            return self.graph.number(0.0)
        if other.content()[0] == "-x":
            return self + (-other)
        if self.content()[0] == "-x":
            return -((-self) + other)
        return self.graph.node("-", self.index, other.index)

    def __mul__(self, other):
        other = self.lifted(other)
        a, b = self.constant(), other.constant()
        if a is not None and b is not None:
            return self.graph.number(a * b)
        for constant, factor in ((a, other), (b, self)):
            if constant is not None:
                if constant == 0.0:
                    return self.graph.number(0.0)
                if constant == 1.0:
                    return factor
                if constant < 0.0:
                    return -(factor * -constant)
        if self.content()[0] == "-x":
            return -((-self) * other)
        if other.content()[0] == "-x":
            return -(self * (-other))
        return self.graph.node("*", *sorted((self.index, other.index)))

    __radd__ = __add__
    __rmul__ = __mul__

    def __rsub__(self, other):
        return self.lifted(other) - self


def derivative(graph, outputs, by):
    """Returns the derivatives of `outputs` by the input `by`."""
    zero = graph.number(0.0)
    known = {}
    for index in range(max(o.index for o in outputs) + 1):
        kind, *rest = graph.nodes[index]
        if kind in ("number", "input"):
            known[index] = graph.number(1.0) if index == by.index else zero
            continue
        a = Value(graph, rest[0])
        da = known[a.index]
        if kind == "sin":
            known[index] = graph.node("cos", a.index) * da
        elif kind == "cos":
            known[index] = -(graph.node("sin", a.index) * da)
        elif kind == "-x":
            known[index] = -da
        else:
            b = Value(graph, rest[1])
            db = known[b.index]
            known[index] = {"+": lambda: da + db, "-": lambda: da - db, "*": lambda: da * b + a * db}[kind]()
    return [known[o.index] for o in outputs]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def plus(a, b):
    return [x + y for x, y in zip(a, b)]


class Joint:
    """A revolute joint with a link, in modified Denavit-Hartenberg frames."""

    def __init__(self, alpha, a, theta, d):
        exact = lambda x: round(x) if abs(x - round(x)) < 1e-12 else x  # noqa: E731 the sine of pi is 0
        self.sin, self.cos = exact(math.sin(alpha)), exact(math.cos(alpha))
        self.theta = theta
        self.arm = [a, -self.sin * d, self.cos * d]

    def inwards(self, v, s, c):
        """A direction of the link's frame in the frame before."""
        x, y, z = v
        x, y = c * x - s * y, s * x + c * y
        return [x, self.cos * y - self.sin * z, self.sin * y + self.cos * z]

    def outwards(self, v, s, c):
        x, y, z = v
        y, z = self.cos * y + self.sin * z, self.cos * z - self.sin * y
        return [c * x + s * y, c * y - s * x, z]

    def body_inwards(self, body, s, c):
        """Mass, first moment and inertia (xx xy xz yy yz zz) about the origin of the frame before."""
        mass, moment, inertia = body
        turned = self.inwards(moment, s, c)
        xx, xy, xz, yy, yz, zz = inertia
        xx, xy, yy = turn(s, c, xx, xy, yy)
        xz, yz = c * xz - s * yz, s * xz + c * yz
        yy, yz, zz = turn(self.sin, self.cos, yy, yz, zz)
        xy, xz = self.cos * xy - self.sin * xz, self.sin * xy + self.cos * xz
        # Parallel axes: the mixed term of the arm with the first moment and half the mass times the arm.
        p = self.arm
        h = [t + 0.5 * mass * x for t, x in zip(turned, p)]
        px, py, pz = (x * y for x, y in zip(p, h))
        inertia = [
            xx + 2 * (py + pz), xy - (p[0] * h[1] + p[1] * h[0]), xz - (p[0] * h[2] + p[2] * h[0]),
            yy + 2 * (px + pz), yz - (p[1] * h[2] + p[2] * h[1]), zz + 2 * (px + py),
        ]
        return mass, [t + mass * x for t, x in zip(turned, p)], inertia


def turn(s, c, xx, xy, yy):
    """The entries of a tensor in a plane after a turn by the angle with this sine and cosine."""
    u = s * (xx - yy) + c * (2 * xy)
    return xx - s * u, c * u - xy, yy + s * u


def grouped(joints, parameters):
    """Parameters with the same action in one: what a joint cannot see moves to the link before."""
    handed, bodies = (0.0, [0.0] * 3, [0.0] * 6), []
    for joint, row in reversed(list(zip(joints, parameters))):
        mass = row[0] + handed[0]
        mx, my, mz = plus(row[1:4], handed[1])
        xx, xy, xz, yy, yz, zz = plus(row[4:10], handed[2])
        bodies.append((0.0, [mx, my, 0.0], [xx - yy, xy, xz, 0.0, yz, zz]))
        handed = joint.body_inwards((mass, [0.0, 0.0, mz], [yy, 0.0, 0.0, yy, 0.0, 0.0]), 0.0, 1.0)
    return bodies[::-1]


def inverse_dynamics(graph, joints, bodies, gravity, turns, qd, qdd):
    zero = graph.number(0.0)
    e = [zero] * 3
    v = [graph.number(-g) for g in gravity]
    w, field, wrenches = [zero] * 3, None, []
    for i, (joint, (mass, h, inertia), (s, c)) in enumerate(zip(joints, bodies, turns)):
        if field:
            v = plus(v, times(field, joint.arm))
        w, e, v = (joint.outwards(x, s, c) for x in (w, e, v))
        e = [e[0] + w[1] * qd[i], e[1] - w[0] * qd[i], e[2] + qdd[i]]
        w = [w[0], w[1], w[2] + qd[i]]
        xx, yy, zz = (x * x for x in w)
        xy, xz, yz = w[0] * w[1], w[0] * w[2], w[1] * w[2]
        # The acceleration of the link's points relative to its origin.
        field = [
            [-(yy + zz), xy - e[2], xz + e[1]],
            [xy + e[2], -(xx + zz), yz - e[0]],
            [xz - e[1], yz + e[0], -(xx + yy)],
        ]
        ixx, ixy, ixz, iyy, iyz, izz = inertia
        moment = [
            ixx * e[0] - ixy * field[2][0] + ixz * field[1][0] + iyz * (yy - zz) + (izz - iyy) * yz,
            iyy * e[1] + ixy * field[2][1] - iyz * field[0][1] + ixz * (zz - xx) + (ixx - izz) * xz,
            izz * e[2] - ixz * field[1][2] + iyz * field[0][2] + ixy * (xx - yy) + (iyy - ixx) * xy,
        ]
        force = [mass * a + b for a, b in zip(v, times(field, h))]
        wrenches.append((force, plus(moment, cross(h, v))))
    torques, force, moment = [], [zero] * 3, [zero] * 3
    for i in reversed(range(len(joints))):
        force, moment = plus(wrenches[i][0], force), plus(wrenches[i][1], moment)
        torques.append(moment[2])
        s, c = turns[i]
        force = joints[i].inwards(force, s, c)
        moment = plus(joints[i].inwards(moment, s, c), cross(joints[i].arm, force))
    return torques[::-1]


def times(matrix, vector):
    rows = ([a * b for a, b in zip(row, vector)] for row in matrix)
    return [a + b + c for a, b, c in rows]


def inertia_matrix(graph, joints, bodies, turns):
    """The lower triangle, row by row, of composite bodies."""
    n = len(joints)
    lift = lambda x: x if isinstance(x, Value) else graph.number(x)  # noqa: E731
    composite = None
    triangle = {}
    for i in reversed(range(n)):
        mass, moment, inertia = bodies[i]
        own = [lift(mass), [lift(x) for x in moment], [lift(x) for x in inertia]]
        if composite:
            own = [own[0] + composite[0], plus(own[1], composite[1]), plus(own[2], composite[2])]
        triangle[i, i] = own[2][5]
        force = [-own[1][1], own[1][0], graph.number(0.0)]
        torque = [own[2][2], own[2][4], own[2][5]]
        for j in reversed(range(i)):
            s, c = turns[j + 1]
            force = joints[j + 1].inwards(force, s, c)
            torque = plus(joints[j + 1].inwards(torque, s, c), cross(joints[j + 1].arm, force))
            triangle[i, j] = torque[2]
        composite = joints[i].body_inwards(own, *turns[i])
    return [triangle[i, j] for i in range(n) for j in range(i + 1)]


def function(graph, name, outputs):
    """The C of a function that computes the outputs."""
    needed, open_nodes = set(), [o.index for o in outputs]
    while open_nodes:
        index = open_nodes.pop()
        if index in needed:
            continue
        needed.add(index)
        kind, *rest = graph.nodes[index]
        if kind not in ("number", "input"):
            open_nodes.extend(rest)

    def word(index):
        kind, *rest = graph.nodes[index]
        if kind == "number":
            return f"(real){rest[0]!r}"
        return rest[0] if kind == "input" else f"v{index}"

    lines = [f"void {name}(const real *restrict q, const real *restrict qd, const real *restrict qdd, real *restrict out) {{"]
    for index in sorted(needed):
        kind, *rest = graph.nodes[index]
        if kind in ("number", "input"):
            continue
        a = word(rest[0])
        right = {
            "sin": f"SIN({a})", "cos": f"COS({a})", "-x": f"-{a}",
        }.get(kind) or f"{a} {kind} {word(rest[1])}"
        lines.append(f"    const real v{index} = {right};")
    lines += [f"    out[{k}] = {word(o.index)};" for k, o in enumerate(outputs)]
    operations = sum(graph.nodes[k][0] in "+-*" for k in needed)
    print(f"{name}: {operations} sums and products", file=sys.stderr)
    return "\n".join([*lines, "}", ""])


def main(source, target):
    with open(source, encoding="utf-8") as file:
        name, n, _ = file.readline().split()
        n = int(n)
        numbers = lambda: [float(x) for x in file.readline().split()]  # noqa: E731
        gravity, joints, parameters = numbers(), [], []
        for _ in range(n):
            joints.append(Joint(*numbers()))
            parameters.append(numbers())
    graph = Graph()
    q, qd, qdd = ([graph.node("input", f"{s}[{i}]") for i in range(n)] for s in ("q", "qd", "qdd"))
    angles = [x + joint.theta for x, joint in zip(q, joints)]
    turns = [(graph.node("sin", a.index), graph.node("cos", a.index)) for a in angles]
    bodies = grouped(joints, parameters)
    torques = inverse_dynamics(graph, joints, bodies, gravity, turns, qd, qdd)
    inertia = inertia_matrix(graph, joints, bodies, turns)
    by_q, by_qd = ([derivative(graph, torques, x) for x in inputs] for inputs in (q, qd))
    by = [column[i] for columns in (by_q, by_qd) for i in range(n) for column in columns]
    with open(target, "w", encoding="utf-8") as file:
        file.write('#include "real.h"\n\n')
        file.write(function(graph, f"{name}_inverse_dynamics", torques))
        file.write(function(graph, f"{name}_inertia_matrix", inertia))
        file.write(function(graph, f"{name}_inverse_dynamics_derivatives", by + inertia))


main(*sys.argv[1:])
