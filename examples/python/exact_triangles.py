"""The numbers of docs/explanation/exact-triangles.md: signs that rounded arithmetic gets wrong."""

# snippet-begin: side
from fractions import Fraction
from typing import Any

import numpy


def side(a: Any, b: Any, c: Any, x: Any, number: Any) -> Any:
    """((b - a) x (c - a)) . (x - a): its sign is the side of the plane of a, b, c on which x lies."""
    u, v, w = ([number(p[i]) - number(a[i]) for i in range(3)] for p in (b, c, x))
    return (
        u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
    )


# snippet-end: side


def show(name: str, a: Any, b: Any, c: Any, x: Any) -> tuple[float, float]:
    exact = side(a, b, c, x, lambda value: Fraction(float(value)))
    rounded = side(a, b, c, x, float)
    normal = numpy.cross(b.astype(float) - a, c.astype(float) - a)
    distance = float(exact) / float(numpy.linalg.norm(normal))
    print(f"{name}: exact {float(exact):.3g}, rounded {rounded:.3g}, distance {distance:.3g}")
    return float(exact), rounded


# A plane that was subdivided at the middles of edges (https://github.com/libigl/libigl/issues/2381).
p2 = numpy.array([0.318053007125854, 0.768364012241364, 0.493088006973267])
p11 = numpy.array([0.323265008628368, 0.7732835114002232, 0.4918477535247805])
p10 = numpy.array([0.308549508452415, 0.7831887602806095, 0.485759757459164])
p1 = numpy.array([0.33890101313591, 0.788042008876801, 0.488126993179321])
p8 = numpy.array([0.324185512959957, 0.7979472577571872, 0.4820389971137045])
p9 = numpy.array([0.333689011633396, 0.7831225097179417, 0.4893672466278075])
assert show("vertex 1", p2, p11, p10, p1)[0] == 0
assert show("vertex 8", p2, p11, p10, p8)[0] == 0
assert show("vertex 9", p2, p11, p10, p9)[0] == 0

# Two triangles in nearly one plane, as floats (https://github.com/libigl/libigl/issues/2382).
q = numpy.array(
    [
        [0.392347991466522, 0.384436011314392, 0.447445005178452],
        [0.3892470002174375, 0.385637506842613, 0.4576234966516495],
        [0.387003496289253, 0.38789276033639897, 0.45634675025939975],
        [0.39079749584197976, 0.3850367590785025, 0.45253425091505073],
        [0.3876965045928953, 0.3862382546067235, 0.4627127423882482],
        [0.39279749989509577, 0.37299175560474374, 0.455539248883724],
    ],
    dtype=numpy.float32,
)
for vertex in (1, 5, 4):
    assert show(f"vertex {vertex}", q[0], q[3], q[2], q[vertex])[0] > 0
for vertex in (0, 3, 2):
    show(f"vertex {vertex}", q[1], q[5], q[4], q[vertex])
