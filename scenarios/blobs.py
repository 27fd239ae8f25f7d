"""Blob animation, frame by frame: a creature walks on animated bones, and two blobs meet, merge and part.

Nothing here has physics: every bone is a primitive whose ends are functions of time. To draw the frames yourself:
    for t in fs.timeline(6, fps=30): image = fs.render(world.at(t), camera)

stride: length of a step
steps: steps per second
"""

import math

import fieldsim as fs

LEGS = [(x, side, (i + (side > 0)) % 2 * math.pi) for i, x in enumerate((-0.55, 0.0, 0.55)) for side in (-1, 1)]


def creature(stride: float, pace: float) -> list[fs.Body]:
    skin = fs.Material(color="moss", radius=0.13, blobbiness=-2)

    def bob(t):
        return 0.62 + 0.04 * math.sin(2 * pace * t)

    def leg(x, side, phase):
        def foot(t):
            swing = pace * t + phase
            return x + 0.5 * stride * math.cos(swing), 0.42 * side, 0.1 + 0.22 * max(0.0, math.sin(swing))

        def knee(t):
            fx, _, fz = foot(t)
            return 0.5 * (x + fx) + 0.08, 0.4 * side, 0.5 * (bob(t) + fz) + 0.12

        return [fs.Segment(lambda t: (x, 0.12 * side, bob(t)), knee), fs.Segment(knee, foot)]

    def nose(t):
        return 1.05, 0.08 * math.sin(pace * t / 2), bob(t) + 0.3

    spine = fs.Segment(lambda t: (-0.7, 0, bob(t)), lambda t: (0.7, 0, bob(t)))
    neck = fs.Segment(spine.end, nose)
    legs = [bone for x, side, phase in LEGS for bone in leg(x, side, phase)]
    tail = fs.Arc(center=lambda t: (-0.7, 0, bob(t) + 0.4), normal=lambda t: (0.3 * math.sin(pace * t), 1, 0),
                  start=(0, 0, -1), radius=0.4, angle=2.4)  # fmt: skip
    return [
        fs.Body([spine, neck, tail, *legs], surface=skin),
        fs.Body(fs.Point(nose), surface=fs.Material(color="sand", radius=0.24, blobbiness=-2)),
    ]


def build(stride: float = 0.5, steps: float = 1.0) -> fs.Scenario:
    world = fs.World(background=fs.Background(top="#c9d8e8", bottom="#8796a8", stars=0))
    for body in creature(stride, math.pi * steps):
        world.add_body(body)
    for side, color in ((-1, "tomato"), (1, "royalblue")):
        meet = fs.Keyframes([0, 3, 6], [(side, 1.2, 1.75), (0.12 * side, 1.2, 1.75), (side, 1.2, 1.75)], loop=True)
        world.add_body(fs.Body(fs.Point(meet), surface=fs.Material(color=color, radius=0.42, blobbiness=-1.5)))
    camera = fs.Camera(eye=(1.5, -4.0, 1.8), look_at=(0.1, 0.4, 0.95), fov=40)
    return fs.Scenario(world, camera, duration=6.0, fps=30)


if __name__ == "__main__":
    fs.main(build)
