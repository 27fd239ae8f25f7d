"""Rows of the tables of contact: geoms as convex sets, their samples and faces; and what is found of contacts.

Of `geoms`, one for a geom (or a vertex of a flex): the core, a convex set in the geom's frame, and all within ROUND of
it.

| columns | names | content |
|---|---|---|
| 0-2 | ORIGIN | of the geom's frame, in the body's inertial frame |
| 3-11 | FRAME | rotation from the geom's frame to that one, by rows |
| 12 | KIND | of the core: POINT, SEGMENT, ELLIPSOID, CYLINDER or POLYTOPE |
| 13-15 | SIZES | semi-axes; of a cylinder radius, radius, half its height; of a segment 0, 0, half its length |
| 16 | ROUND | how far the geom reaches beyond its core |
| 17 | BOUND | how far it reaches from ORIGIN |
| 18 | HARDNESS | stiffness times size^3, where size is the lesser of the geom's and the surface's |
| 19 | SLIGHT | 1 / (half its thickness)^3 |
| 20 | GEOM | its number; of a flex -1 minus its number |
| 21 | FIRST_SAMPLE | the first of its rows of `samples` |
| 22 | SAMPLE_COUNT | how many there are |
| 23 | FIRST_FACE | the first of its rows of `faces` |
| 24 | FACE_COUNT | how many there are |

Of `samples`: places of the core, in the geom's frame. Of `faces`: triangles of a polytope.

| columns | names | content |
|---|---|---|
| 0-2 | CORNER | one corner, in the geom's frame |
| 3-5 | ONE | the edge from there to the next corner |
| 6-8 | OTHER | the edge from there to the last corner |

Of the contacts of one geom, while they are found:

| columns | names | content |
|---|---|---|
| 0-2 | CORE | the core's point |
| 3-5 | FOOT | the surface's nearest point |
| 6-8 | NORMAL | of the surface there, unit |
| 9-11 | RISE | gradient of LEVEL by the core's point |
| 12 | LEVEL | minus the depth over the size |
| 13 | DEPTH | how far the geom reaches into the surface |
| 14 | STRICT | whether FOOT is the nearest of all around it, and not only as near |
| 15 | ENERGY | that the contact alone would store, over HARDNESS |
| 16 | SHARE | of it that counts, and of its force |

Of `hits`, one for a contact, for damping and friction (of row 0, BODY counts the others):

| columns | names | content |
|---|---|---|
| 0 | BODY | place of the body in the plan |
| 1-3 | PLACE | where the geom touches |
| 4-6 | WAY | the surface's normal there, unit |
| 7 | PUSH | the elastic force |
"""

from fieldsim.potentials.row import Layout

POINT, SEGMENT, ELLIPSOID, CYLINDER, POLYTOPE = range(5)

GEOMS = Layout()
ORIGIN = GEOMS.vector("ORIGIN", "of the geom's frame, in the body's inertial frame")
FRAME = GEOMS.numbers("FRAME", 9, "rotation from the geom's frame to that one, by rows")
KIND = GEOMS.number("KIND", "of the core: POINT, SEGMENT, ELLIPSOID, CYLINDER or POLYTOPE")
SIZES = GEOMS.vector(
    "SIZES", "semi-axes; of a cylinder radius, radius, half its height; of a segment 0, 0, half its length"
)
ROUND = GEOMS.number("ROUND", "how far the geom reaches beyond its core")
BOUND = GEOMS.number("BOUND", "how far it reaches from ORIGIN")
HARDNESS = GEOMS.number("HARDNESS", "stiffness times size^3, where size is the lesser of the geom's and the surface's")
SLIGHT = GEOMS.number("SLIGHT", "1 / (half its thickness)^3")
GEOM = GEOMS.number("GEOM", "its number; of a flex -1 minus its number")
FIRST_SAMPLE = GEOMS.number("FIRST_SAMPLE", "the first of its rows of `samples`")
SAMPLE_COUNT = GEOMS.number("SAMPLE_COUNT", "how many there are")
FIRST_FACE = GEOMS.number("FIRST_FACE", "the first of its rows of `faces`")
FACE_COUNT = GEOMS.number("FACE_COUNT", "how many there are")
ORIGIN_X, FRAME_XX, SIZE_X, SIZE_Y, SIZE_Z = ORIGIN.start, FRAME.start, *range(SIZES.start, SIZES.stop)

FACES = Layout()
CORNER = FACES.vector("CORNER", "one corner, in the geom's frame")
ONE = FACES.vector("ONE", "the edge from there to the next corner")
OTHER = FACES.vector("OTHER", "the edge from there to the last corner")
CORNER_X, ONE_X, OTHER_X = CORNER.start, ONE.start, OTHER.start

CONTACT = Layout()
CORE = CONTACT.vector("CORE", "the core's point")
FOOT = CONTACT.vector("FOOT", "the surface's nearest point")
NORMAL = CONTACT.vector("NORMAL", "of the surface there, unit")
RISE = CONTACT.vector("RISE", "gradient of LEVEL by the core's point")
LEVEL = CONTACT.number("LEVEL", "minus the depth over the size")
DEPTH = CONTACT.number("DEPTH", "how far the geom reaches into the surface")
STRICT = CONTACT.number("STRICT", "whether FOOT is the nearest of all around it, and not only as near")
ENERGY = CONTACT.number("ENERGY", "that the contact alone would store, over HARDNESS")
SHARE = CONTACT.number("SHARE", "of it that counts, and of its force")
CORE_X, FOOT_X, NORMAL_X, RISE_X = CORE.start, FOOT.start, NORMAL.start, RISE.start

HIT = Layout()
BODY = HIT.number("BODY", "place of the body in the plan")
PLACE = HIT.vector("PLACE", "where the geom touches")
WAY = HIT.vector("WAY", "the surface's normal there, unit")
PUSH = HIT.number("PUSH", "the elastic force")
PLACE_X, WAY_X = PLACE.start, WAY.start

# Deepest points of one geom that are kept at most, those above the surface that are; and samples of a geom.
MOST_DEEPEST, MOST_ABOVE = 24, 12
MOST_SAMPLES = 64
