"""Contact by a potential: every geom is pushed out of the surface F = 1 where it reaches into it.

A geom stores the energy

    sum over samples s of U_s + sum over deepest points m of U_m product over s of (1 - U_s / U_m),

U = stiffness depth^3 / 3 each: samples (corners, points of rims and hulls, ends) alone hold what stands flat; the
deepest points (see `search`) add what samples do not feel, a tip under a face or a wire across an edge. A deepest point
that moves into a sample goes on without a jump, as the product then is 0. The force is the energy's gradient: where a
deepest point lies changes its depth only in second order.

Rows of `geoms`, `samples`, `faces` and `hits`: see `mujoco.contact.rows`; of `law` and `found`: `mujoco.callback.rows`.
"""

import functools

from fieldsim.dynamics.contact.laws import pressed
from fieldsim.mujoco.callback.evaluate import field_at, maker, room_at, turns, vectors
from fieldsim.mujoco.callback.rows import (
    CONTACT_ENERGY,
    DAMPING,
    DEEP,
    DEEPEST,
    FORCE_X,
    FRICTION,
    HEAVIEST,
    SHARE_OF_SIZE,
    TORQUE_X,
)
from fieldsim.mujoco.contact.rows import (
    BODY,
    BOUND,
    CORE_X,
    DEPTH,
    ENERGY,
    FIRST_SAMPLE,
    FOOT_X,
    GEOM,
    HARDNESS,
    LEVEL,
    NORMAL_X,
    ORIGIN_X,
    PLACE_X,
    PUSH,
    RISE_X,
    ROUND,
    SAMPLE_COUNT,
    SHARE,
    WAY_X,
)
from fieldsim.mujoco.contact.search import deepest, noting, placed
from fieldsim.mujoco.contact.surface import THIRD, felt_at


@functools.cache
def _sampled(native: bool):
    """Function (i, at, plan, turns, contacts, count): contacts of the samples of geom i, behind `count`; the new count.

    Those of what is round begin where a deepest point touches.
    """
    field = field_at(native)
    felt = felt_at(native)
    note = noting(native)
    _, outside, _ = placed(native)

    @maker(native)
    def touches(c, rounded, plan, turned, count):
        if rounded:
            return count > 0
        return field(c, plan.surface, turned)[0] > 1.0

    @maker(native)
    def sample(i, at, plan, turned, contacts, count):
        row = plan.geoms
        radius = plan.law[HEAVIEST] ** -THIRD
        total = count
        rounded = row[i, ROUND] > 0.0
        first = int(row[i, FIRST_SAMPLE])
        for s in range(first, first + int(row[i, SAMPLE_COUNT])):
            c = outside(at, (plan.samples[s, 0], plan.samples[s, 1], plan.samples[s, 2]))
            if not touches(c, rounded, plan, turned, count):
                continue
            best = total
            for k in range(count if rounded else 1):
                q = (contacts[k, FOOT_X], contacts[k, FOOT_X + 1], contacts[k, FOOT_X + 2]) if rounded else c
                now = felt(c, q, q, radius, i, plan, turned)
                if now[0] and now[3] < 0.0 and (best == total or now[3] < contacts[total, LEVEL]):
                    note(contacts, total, c, now, row[i, ROUND])
                    best = total + 1
            total = best
        return total

    return sample


@functools.cache
def _shared(native: bool):
    """Function (contacts, deep, total): the energy of contacts, `deep` deepest points and then samples; sets SHARE.

    A contact's SHARE is the derivative of the sum by its own energy.
    """

    @maker(native)
    def rest(contacts, m, deep, total, but):
        """The product over all samples but one."""
        whole = 1.0
        for s in range(deep, total):
            if s != but:
                whole *= max(1.0 - contacts[s, ENERGY] / contacts[m, ENERGY], 0.0)
        return whole

    @maker(native)
    def share(contacts, deep, total):
        energy = 0.0
        for s in range(deep, total):
            energy += contacts[s, ENERGY]
        for m in range(deep):
            u = contacts[m, ENERGY]
            whole = rest(contacts, m, deep, total, -1)
            energy += u * whole
            contacts[m, SHARE] = whole
            for s in range(deep, total):
                if contacts[s, ENERGY] < u:
                    others = rest(contacts, m, deep, total, s)
                    contacts[m, SHARE] += contacts[s, ENERGY] / u * others
                    contacts[s, SHARE] -= others
        return energy

    return share


@functools.cache
def _pushed(native: bool):
    """Function (k, i, c, views, plan, room): add contact c's force to what body k feels, and note the hit."""
    _, cross, _ = vectors(native)
    law_of = pressed.native if native else pressed

    @maker(native)
    def push(k, i, c, views, plan, room):
        contacts, found, hits, x = room.contacts, room.pushes, room.hits, views.xipos
        b = plan.bodies[k]
        level, row = contacts[c, LEVEL], plan.geoms
        strength = law_of(-level, row[i, HARDNESS])[1] * contacts[c, SHARE]
        force = strength * contacts[c, RISE_X], strength * contacts[c, RISE_X + 1], strength * contacts[c, RISE_X + 2]
        arm = contacts[c, CORE_X] - x[b, 0], contacts[c, CORE_X + 1] - x[b, 1], contacts[c, CORE_X + 2] - x[b, 2]
        torque = cross(arm, force)
        for j in range(3):
            found[k, FORCE_X + j] += force[j]
            found[k, TORQUE_X + j] += torque[j]
        if -level > found[k, SHARE_OF_SIZE]:
            found[k, SHARE_OF_SIZE], found[k, DEEP], found[k, DEEPEST] = -level, contacts[c, DEPTH], row[i, GEOM]
        pressed = 0.0
        for j in range(3):
            pressed += force[j] * contacts[c, NORMAL_X + j]
        if not pressed > 0.0 or plan.law[DAMPING] + plan.law[FRICTION] == 0.0:
            return
        count = int(hits[0, BODY]) + 1
        hits[0, BODY] = count
        hits[count, BODY], hits[count, PUSH] = k, pressed
        for j in range(3):
            hits[count, PLACE_X + j] = contacts[c, CORE_X + j] - row[i, ROUND] * contacts[c, NORMAL_X + j]
            hits[count, WAY_X + j] = contacts[c, NORMAL_X + j]

    return push


@functools.cache
def touch(native: bool):
    """Function (k, plan, views, turns, room): the elastic forces, torques and energies of a body's contacts.

    They are left in row k of room.pushes, see FOUND; room.hits gets them one by one.
    """
    room_of = room_at(native)
    place, _, _ = placed(native)
    find, sample = deepest(native), _sampled(native)
    share, push = _shared(native), _pushed(native)
    turn, _ = turns(native)

    @maker(native)
    def touched(k, plan, views, turned, room):
        b = plan.bodies[k]
        x, row = views.xipos, plan.geoms
        room.pushes[k] = 0.0
        if room_of((x[b, 0], x[b, 1], x[b, 2]), plan.surface, turned) > plan.reach[k]:
            return
        for i in range(plan.first_geom[k], plan.first_geom[k + 1]):
            o = turn(views.ximat, b, (row[i, ORIGIN_X], row[i, ORIGIN_X + 1], row[i, ORIGIN_X + 2]))
            o = o[0] + x[b, 0], o[1] + x[b, 1], o[2] + x[b, 2]
            if room_of(o, plan.surface, turned) > row[i, BOUND]:
                continue
            at = place(views, b, plan, i)
            deep = find(i, at, plan, turned, room.contacts)
            total = sample(i, at, plan, turned, room.contacts, deep)
            energy = row[i, HARDNESS] * share(room.contacts, deep, total)
            room.pushes[k, CONTACT_ENERGY] += energy
            for c in range(total):
                push(k, i, c, views, plan, room)

    return touched
