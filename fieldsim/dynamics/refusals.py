"""What tools and methods do not know of a world: one table, read where a tool is called or a simulation is made.

Nothing is left out in silence, and nothing is refused in the middle of a run.
"""

from fieldsim.errors import InputError
from fieldsim.world.rigid import Rigid


def _contact(world):
    for index, particles in enumerate(world.particles):
        if particles.contact is not None:
            return f"particles of set {index} have contact {particles.contact!r}"


def _escape(world):
    if world.escape_radius is not None:
        return f"the world's escape_radius is {world.escape_radius:g}"


def _pull(world):
    for index, particles in enumerate(world.particles):
        if particles.gravity is not None:
            return f"particles of set {index} pull each other (gravity={particles.gravity!r})"


def _free(world):
    for index, body in enumerate(world.bodies):
        if body.free:
            return f"{body_name(index, body)} moves freely (motion=fs.Rigid)"


def _losses(world):
    for index, body in enumerate(world.bodies):
        if isinstance(body.motion, Rigid) and body.motion.loses:
            motion = body.motion
            return (
                f"{body_name(index, body)} loses energy where it touches (Rigid(restitution={motion.restitution:g}, "
                f"friction={motion.friction:g}))"
            )


# What a world may have: who finds and names it, and how to do without.
TRAITS = {
    "contact": (_contact, "give them contact=None"),
    "escape": (_escape, "leave it out: world.replace(escape_radius=None)"),
    "pull": (_pull, "give them gravity=None"),
    "free": (_free, "give it a motion that is known"),
    "losses": (_losses, "give it restitution=1 and friction=0"),
}
SPLITTING = ", or the simulation a splitting without force gradients, such as fs.BlanesMoan6(dt)"
# Who does not know what, in which words, and what would do instead.
TABLE = {
    "Radau": (("contact", "free"), "which Radau does not know", SPLITTING),
    "force gradients": (("free",), "which force gradients do not know", SPLITTING),
    "steps backwards": (
        ("losses",),
        "which methods with steps backwards do not know",
        ", or the simulation fs.Leapfrog(dt)",
    ),
    "pull": (
        ("contact", "escape", "free"),
        "but particles cannot both pull each other and collide or escape, nor pull what moves freely",
        "",
    ),
    "MuJoCo": (("pull", "free"), "which a MuJoCo model does not feel", ""),
    "poincare": (("contact", "escape", "pull"), "which a section does not know", ""),
    "lyapunov": (("contact", "escape", "pull"), "which the exponents do not know", ""),
}


def refusal(who: str, world) -> str:
    """What of `world` the tool or method `who` (of TABLE) does not know, and the remedy; "" where it knows all."""
    traits, unknown, instead = TABLE[who]
    for find, remedy in (TRAITS[trait] for trait in traits):
        what = find(world)
        if what:
            return f"{what}, {unknown}; {remedy}{instead}"
    return ""


def refuse(owner: str, who: str, world) -> None:
    """Raise InputError for what of `world` the tool or method `who` does not know."""
    _raise(owner, refusal(who, world))


def _raise(owner, words):
    if words:
        raise InputError(f"{owner}: {words}")


def method_refusal(method, world) -> str:
    """What of `world` an integrator cannot move, and the remedy, or ""."""
    if not hasattr(method, "kicks"):  # it is no splitting
        return refusal("Radau", world)
    if any(method.gradients):
        return refusal("force gradients", world)
    return refusal("steps backwards", world) if min(*method.kicks, *method.drifts) < 0.0 else ""


def refuse_method(owner: str, method, world) -> None:
    """Raise InputError for what of `world` an integrator cannot move."""
    _raise(owner, method_refusal(method, world))


def refuse_mixture(owner: str, world) -> None:
    """Raise InputError where parts of `world` do not go together, whatever moves it."""
    pulling = [(index, particles) for index, particles in enumerate(world.particles) if particles.gravity is not None]
    for index, particles in pulling[1:]:
        first, law = pulling[0][0], pulling[0][1].gravity
        if particles.gravity != law:
            raise InputError(
                f"{owner}: particles pull each other with different kernels, {law!r} of set {first} and "
                f"{particles.gravity!r} of set {index}; give them one gravity"
            )
    if pulling:
        refuse(owner, "pull", world)


def refuse_other_matter(owner: str, before, now) -> None:
    """Raise InputError where a world `now` has not the bodies, particles and escape radius of the one `before`."""
    was, has = ((*world.bodies, *world.particles) for world in (before, now))
    if before.escape_radius != now.escape_radius or list(map(id, was)) != list(map(id, has)):
        raise InputError(
            f"{owner}: its world has been given or has lost bodies or particles, or its escape_radius has changed, "
            f"since the {owner} was made; make another {owner} of it"
        )


def body_name(index: int, body) -> str:
    """A body as it stands in a message."""
    return f"Body {index}" + (f" ({body.name})" if body.name else "")
