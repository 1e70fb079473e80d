"""The rules of throng.mesh in exact rational numbers, pair by pair."""

from collections.abc import Sequence
from fractions import Fraction
from itertools import combinations, product
from typing import Any

from reference import Pairs

Point = tuple[Fraction, Fraction, Fraction]
Corners = Sequence[Point]


def minus(a: Point, b: Point) -> Point:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a: Point, b: Point) -> Fraction:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> Point:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def along(a: Point, b: Point, t: Fraction) -> Point:
    d = minus(b, a)
    return (a[0] + t * d[0], a[1] + t * d[1], a[2] + t * d[2])


def clamped(t: Fraction) -> Fraction:
    return min(max(t, Fraction(0)), Fraction(1))


def edges_of(corners: Corners) -> list[tuple[Point, Point]]:
    return list(combinations(corners, 2))


def normal_of(corners: Corners) -> Point:
    return cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]))


def to_segment(p: Point, a: Point, b: Point) -> Fraction:
    """The square of the distance from p."""
    d = minus(b, a)
    length = dot(d, d)
    nearest = along(a, b, clamped(dot(minus(p, a), d) / length)) if length else a
    offset = minus(p, nearest)
    return dot(offset, offset)


def is_above(p: Point, corners: Corners) -> bool:
    """Whether the projection of p to the plane of a triangle with area lies in the triangle."""
    normal = normal_of(corners)
    sides = []
    for k in range(3):
        a, b = corners[k], corners[(k + 1) % 3]
        sides.append(dot(cross(minus(b, a), minus(p, a)), normal))
    return all(side >= 0 for side in sides)


def to_triangle(p: Point, corners: Corners) -> Fraction:
    normal = normal_of(corners)
    if any(normal) and is_above(p, corners):
        height = dot(minus(p, corners[0]), normal)
        return height * height / dot(normal, normal)
    return min(to_segment(p, a, b) for a, b in edges_of(corners))


def hull_has(p: Point, corners: Corners) -> bool:
    """Whether p lies in the convex hull of up to three points."""
    if len(corners) == 3:
        return to_triangle(p, corners) == 0
    return len(corners) > 0 and to_segment(p, corners[0], corners[-1]) == 0


def crossing_of_segments(a: Point, b: Point, c: Point, d: Point) -> Point | None:
    """The point of two segments that are not parallel."""
    u, v, w = minus(b, a), minus(d, c), minus(c, a)
    n = cross(u, v)
    if not any(n) or dot(w, n) != 0:
        return None
    t = dot(cross(w, v), n) / dot(n, n)
    s = dot(cross(w, u), n) / dot(n, n)
    return along(a, b, t) if 0 <= t <= 1 and 0 <= s <= 1 else None


def crossing_of_plane(a: Point, b: Point, corners: Corners) -> Point | None:
    """Where a segment that is not parallel to the plane of the corners crosses them."""
    n = normal_of(corners)
    slope = dot(minus(b, a), n)
    if slope == 0:
        return None
    t = dot(minus(corners[0], a), n) / slope
    if not 0 <= t <= 1:
        return None
    p = along(a, b, t)
    return p if hull_has(p, corners) else None


def extreme_points(s: Corners, t: Corners) -> list[Point]:
    """Points of the intersection of two triangles, its corners among them."""
    found = [p for p in s if hull_has(p, t)] + [p for p in t if hull_has(p, s)]
    for one, other in ((s, t), (t, s)):
        for a, b in edges_of(one):
            p = crossing_of_plane(a, b, other)
            found += [p] if p else []
    for (a, b), (c, d) in product(edges_of(s), edges_of(t)):
        p = crossing_of_segments(a, b, c, d)
        found += [p] if p else []
    return found


def triangles_of(vertices: Any, faces: Any) -> list[Corners]:
    points = [(Fraction(float(x)), Fraction(float(y)), Fraction(float(z))) for x, y, z in vertices]
    return [[points[i] for i in face] for face in faces.tolist()]


def self_intersections(vertices: Any, faces: Any) -> Pairs:
    triangles = triangles_of(vertices, faces)
    found = []
    for i, k in combinations(range(len(triangles)), 2):
        indices = sorted(set(faces[i].tolist()) & set(faces[k].tolist()))
        shared = [triangles[i][faces[i].tolist().index(index)] for index in indices]
        outside = (p for p in extreme_points(triangles[i], triangles[k]) if not hull_has(p, shared))
        if len(shared) == 3 or any(True for _ in outside):
            found.append((i, k))
    return found


def intersections(a: tuple[Any, Any], b: tuple[Any, Any]) -> Pairs:
    first, second = triangles_of(*a), triangles_of(*b)
    every = product(range(len(first)), range(len(second)))
    return [(i, k) for i, k in every if extreme_points(first[i], second[k])]


def segments_apart(a: Point, b: Point, c: Point, d: Point) -> Fraction:
    """The square of the distance of two segments."""
    ends = [to_segment(a, c, d), to_segment(b, c, d), to_segment(c, a, b), to_segment(d, a, b)]
    u, v, w = minus(b, a), minus(d, c), minus(c, a)
    n = cross(u, v)
    if any(n):
        t = dot(cross(w, v), n) / dot(n, n)
        s = dot(cross(w, u), n) / dot(n, n)
        if 0 <= t <= 1 and 0 <= s <= 1:
            offset = dot(w, n)
            ends.append(offset * offset / dot(n, n))
    return min(ends)


def apart(s: Corners, t: Corners) -> Fraction:
    """The square of the distance of two triangles."""
    if extreme_points(s, t):
        return Fraction(0)
    points = [to_triangle(p, t) for p in s] + [to_triangle(p, s) for p in t]
    edges = [segments_apart(*one, *other) for one, other in product(edges_of(s), edges_of(t))]
    return min(points + edges)
