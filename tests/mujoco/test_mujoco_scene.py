"""MuJoCo models in pictures: geoms and skins are where they should be."""

import copy

import mujoco
import numpy as np
import pytest
from mujoco_scenes import ALL_KINDS, CAMERA, CHECKERED, HUMANOID, PLANET, SIZE, pixel_rays, posed

import fieldsim as fs
from fieldsim.mujoco.models import model_of
from fieldsim.mujoco.scene.geoms import material_of
from fieldsim.mujoco.scene.skins import medial
from fieldsim.numerics import quaternion
from fieldsim.render.solids.packing import solids_of
from fieldsim.sources.elements import surface_of

# Geoms


def test_geoms_are_where_mujocos_own_rays_find_them():
    model, data = posed(ALL_KINDS)
    scene = fs.mujoco.Scene(fs.World(), model)
    layers = fs.Renderer(SIZE).layers(scene.snapshot(data), CAMERA)
    rays, eye, found = pixel_rays(CAMERA, SIZE), np.array(CAMERA.eye), np.zeros(1, dtype=np.int32)
    seen = np.array([1, 1, 1, 0, 0, 0], dtype=np.uint8)
    depth, owner = np.full(layers["depth"].shape, np.inf), np.full(layers["depth"].shape, -1)
    for place in np.ndindex(depth.shape):
        distance = mujoco.mj_ray(model, data, eye, rays[place], seen, 1, -1, found)
        if distance >= 0.0:
            depth[place], owner[place] = distance, scene.geoms.index(found[0])
    # Where a ray grazes an outline, either may be right.
    same = (owner == layers["owner"]) & np.isfinite(depth)
    missed = (owner < 0) & (layers["owner"] < 0)
    assert np.mean(same | missed) > 0.995
    assert set(owner[same]) == set(range(7))
    # float32 against float64, of lengths of 5; at a grazing hit an error of it grows by the slope.
    assert np.quantile(np.abs(depth[same] - layers["depth"][same]), 0.99) < 2e-5


def test_geoms_look_as_in_mujoco():
    scene = fs.mujoco.Scene(fs.World(), ALL_KINDS)
    ball, cylinder = (scene.world.shapes[0].materials[k] for k in (1, 4))
    assert ball.color == pytest.approx((1.0, 0.8, 0.2))
    assert (ball.specular, ball.shininess) == pytest.approx((0.7, 64.0))
    assert cylinder.color == (0.0, 1.0, 0.0)  # a geom's own colour goes before its material's
    assert scene.world.shapes[0].shapes[0].extent == (3.0, 2.0)


def test_geoms_are_as_clear_and_as_mirroring_as_in_mujoco():
    model = model_of(
        '<mujoco><asset><material name="ice" rgba=".5 .7 1 .25" reflectance=".3"/></asset><worldbody>'
        '<geom type="box" size="1 1 1" material="ice"/><geom size="1" material="ice"/></worldbody></mujoco>'
    )
    box, ball = (material_of(model, geom) for geom in range(2))
    assert (box.transmission, box.ior, box.reflection) == pytest.approx((0.75, 1.0, 0.3))
    assert (ball.transmission, ball.reflection) == pytest.approx((0.75, 0.0))


def test_textures_become_checkers_and_means():
    for uniform, tile in (("true", 0.25), ("false", 0.5)):
        with pytest.warns(fs.FieldsimWarning, match="texture 'grid' \\(as one colour\\)"):  # on the ball
            group = fs.mujoco.Scene(fs.World(), CHECKERED.format(uniform=uniform)).world.shapes[0]
        assert group.shapes[0].tile == tile
        np.testing.assert_allclose(group.shapes[0].checker, (1, 0, 0), atol=1e-6)
        np.testing.assert_allclose(group.materials[0].color, (0, 0, 0.5), atol=1e-6)
        np.testing.assert_allclose(group.materials[1].color, (0.5, 0, 0.25), atol=1e-2)


def test_what_the_world_holds_stays_in_the_picture():
    world = fs.World()
    world.add_body(PLANET)
    world.add_shape([fs.Ball(), fs.Ball()], motion=fs.Spin())
    world.add_particles([(0, 0, 2)], [(0, 0, 0)])
    model, data = posed(ALL_KINDS)
    data.time = 0.5
    snapshot = fs.mujoco.Scene(world, model).snapshot(data)
    solids = solids_of(snapshot)
    assert len(solids) == 2 + 7
    np.testing.assert_allclose(solids.axes[0], solids_of(world.at(0.5)).axes[0])
    assert len(surface_of(snapshot).materials) == len(snapshot.spheres[1]) == 1
    assert len(world.shapes) == 1  # the world itself is left as it was


def test_a_planets_geom_is_not_drawn_twice():
    planet = fs.mujoco.planet_geom(PLANET, kind="mesh", resolution=12)
    model, _ = posed(
        f"<mujoco><asset>{planet.asset}</asset><worldbody>{planet.body}<geom size='1'/></worldbody></mujoco>"
    )
    assert len(fs.mujoco.Scene(fs.World(), model).geoms) == 2
    assert len(fs.mujoco.Scene(fs.World(), model, planets=planet).geoms) == 1


# What is not drawn

UNDRAWN = """
<mujoco>
  <asset>
    <hfield name="hills" nrow="4" ncol="4" size="1 1 1 1"/>
    <texture name="stripes" type="2d" builtin="gradient" rgb1="1 0 0" rgb2="0 0 1" width="8" height="8"/>
    <texture name="even" type="2d" builtin="flat" rgb1=".5 .5 .5" width="8" height="8"/>
    <texture name="wrap" type="cube" builtin="flat" rgb1="1 0 0" width="8" height="8"/>
    <material name="stripes" texture="stripes"/><material name="even" texture="even"/>
    <material name="wrap" texture="wrap"/>
  </asset>
  <worldbody>
    <geom name="land" type="hfield" hfield="hills" group="{group}"/><site name="hook" pos="0 0 2" group="{group}"/>
    <body pos="0 0 1"><freejoint/><geom size=".1" material="stripes" group="{group}"/>
      <geom size=".1" material="even" group="{group}"/>
      <geom size=".1" material="wrap" group="{group}"/><site name="eye" type="box" size=".2 .1 .1" group="{group}"/>
      <body><joint name="hinge"/><geom size=".1" group="{group}"/></body></body>
    <flexcomp name="cloth" type="grid" count="4 4 1" spacing=".2 .2 .2" dim="2" mass="1" radius=".02" rgba="{rgba}"
      flatskin="false"><edge equality="true"/></flexcomp>
  </worldbody>
  <deformable><skin name="hide" rgba="{rgba}" vertex="0 0 0 1 0 0 0 1 0" face="0 1 2">
    <bone body="world" bindpos="0 0 0" bindquat="1 0 0 0" vertid="0 1 2" vertweight="1 1 1"/></skin></deformable>
  <tendon>
    <spatial name="rope" group="{group}"><site site="hook"/><site site="eye"/></spatial>
    <spatial name="clear" rgba="1 1 1 0"><site site="hook"/><site site="eye"/></spatial>
    <fixed name="gear"><joint joint="hinge" coef="1"/></fixed>
  </tendon>
  <sensor><rangefinder name="beam" site="eye"/></sensor>
</mujoco>
"""


def test_what_is_not_drawn_is_told_of_by_name():
    with pytest.warns(fs.FieldsimWarning) as told:
        scene = fs.mujoco.Scene(fs.World(), UNDRAWN.format(group=0, rgba="1 1 1 1"))
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    scene.model.geom_rgba[1] = 1.0
    scene.snapshot(data)  # without another word
    words = str(told[0].message)
    assert len(told) == 1
    for name in ("geom 'land'", "tendon 'rope'", "flex 'cloth'", "skin 'hide'", "range finder 'beam'", "'stripes'"):
        assert name in words
    assert "texture 'wrap'" in words, "it counts as white, and is red"
    for name in ("clear", "gear", "even", "hook"):
        assert name not in words


def test_an_experiment_tells_of_it_once():
    world = fs.World()
    world.add_body(PLANET)
    with pytest.warns(fs.FieldsimWarning, match="tendon 'rope'") as told:
        fs.mujoco.Experiment(
            world, CAMERA, model=UNDRAWN.format(group=0, rgba="1 1 1 1"), keep_gravity=True, duration=1
        )
    assert len(told) == 1


def test_what_mujoco_hides_is_not_told_of():
    without = UNDRAWN.replace('<rangefinder name="beam" site="eye"/>', "")
    fs.mujoco.Scene(fs.World(), without.format(group=3, rgba="1 1 1 0"))


def test_sites_are_drawn():
    model, data = posed(
        '<mujoco><worldbody><body pos="1 0 0" euler="0 0 30"><joint/><geom size=".1"/>'
        '<site type="box" size=".3 .2 .1" pos="0 1 0" quat="1 .2 0 0" rgba="1 0 0 1"/><site group="4"/></body>'
        "</worldbody></mujoco>"
    )
    scene = fs.mujoco.Scene(fs.World(), model)
    assert (scene.geoms, scene.sites) == ([0], [0])
    group, (places, turns) = scene.world.shapes[0], scene.snapshot(data).shape_poses[0]
    assert isinstance(group.shapes[1], fs.Box)
    assert group.materials[1].color == (1.0, 0.0, 0.0)
    np.testing.assert_allclose(places[1], data.site_xpos[0])
    np.testing.assert_allclose(quaternion.matrices(turns[1]), data.site_xmat[0].reshape(3, 3), atol=1e-14)


def test_colours_and_sizes_that_are_changed_later_are_seen():
    model, data = posed(ALL_KINDS)
    scene = fs.mujoco.Scene(fs.World(), model)
    before = scene.snapshot(data)
    assert scene.snapshot(data).world is before.world
    model.geom_rgba[1], model.geom_size[1, 0] = (0, 0, 1, 1), 0.5
    model.geom_group[2] = 4
    after = scene.snapshot(data).world.shapes[0]
    assert after.materials[1].color == (0.0, 0.0, 1.0)
    assert after.shapes[1].radius == 0.5
    assert len(after.shapes) == len(before.world.shapes[0].shapes) - 1 == 6
    assert before.world.shapes[0].shapes[1].radius == pytest.approx(0.3), "moments are what they were"


def test_what_the_world_gets_later_is_drawn():
    world = fs.World()
    model, data = posed(ALL_KINDS)
    scene = fs.mujoco.Scene(world, model)
    assert len(scene.snapshot(data).poses) == 0
    world.add_body(PLANET)
    world.background = fs.Background("white")
    after = scene.snapshot(data)
    assert after.world.bodies == (PLANET,)
    assert after.world.background is world.background
    assert scene.snapshot(data).world is after.world


def test_a_motion_that_blew_up_is_not_drawn():
    model, data = posed(ALL_KINDS)
    data.xpos[2] = np.nan
    with pytest.raises(fs.InputError, match="positions are not finite"):
        fs.mujoco.Scene(fs.World(), model).snapshot(data)


def test_copies_that_look_otherwise_are_not_drawn_as_the_model():
    model, _ = posed(ALL_KINDS)
    scene = fs.mujoco.Scene(fs.World(), model)
    turned = copy.copy(model)
    turned.geom_quat[3] = 0.8, 0.6, 0.0, 0.0
    data = mujoco.MjData(turned)
    mujoco.mj_kinematics(turned, data)
    wanted = fs.mujoco.Scene(fs.World(), turned).snapshot(data)
    for found, right in zip(scene.snapshot(data).shape_poses[-1], wanted.shape_poses[-1], strict=True):
        np.testing.assert_array_equal(found, right)
    turned.geom_size[2] *= 2.0
    with pytest.raises(fs.InputError, match="a copy that looks otherwise"):
        scene.snapshot(data)


def test_other_models_are_refused():
    model, data = posed(HUMANOID)
    other, others = posed(ALL_KINDS)
    skin = fs.mujoco.skin(other)
    with pytest.raises(fs.InputError, match=r"skins\[0\] is of another model"):
        fs.mujoco.Scene(fs.World(), model, skins=skin)
    with pytest.raises(fs.InputError, match="data belongs to another model"):
        fs.mujoco.Scene(fs.World(), model).snapshot(others)
    with pytest.raises(fs.InputError, match="the skin is of another model"):
        skin.poses(data)
    with pytest.raises(fs.InputError, match="data is 3"):
        fs.mujoco.Scene(fs.World(), model).snapshot(3)


# Skins


def test_what_a_skin_makes_of_sizes():
    def ends(half):
        primitives, radius = medial(half)
        return [tuple(getattr(p, n) for n in p.points) for p in primitives], radius

    assert ends((0.2, 0.2, 0.2)) == ([((0.0, 0.0, 0.0),)], pytest.approx(0.2))
    assert ends((0.1, 0.1, 0.5)) == ([((0, 0, -0.4), (0, 0, 0.4))], 0.1)
    plates, radius = ends((0.5, 0.1, 0.3))
    assert radius == 0.1
    assert len(plates) == 2
    corners = np.unique(np.concatenate(plates), axis=0)
    np.testing.assert_allclose(np.abs(corners), [(0.4, 0.0, 0.2)] * 4)


def test_skins_follow_their_bodies():
    model, data = posed(HUMANOID)
    skin = fs.mujoco.skin(model)
    assert len(skin.bodies) == len(skin.geoms) == model.ngeom
    data.qpos[:] += 0.3 * np.random.default_rng(1).normal(size=model.nq)
    mujoco.mj_kinematics(model, data)
    scene = fs.mujoco.Scene(fs.World(), model, skins=skin)
    snapshot = scene.snapshot(data)
    assert not scene.geoms
    field = snapshot.surface_field()
    for geom in range(model.ngeom):
        # The axis of every geom is well within the skin, up to its ends; and far from all of them there is nothing.
        along = model.geom_size[geom, 1] * data.geom_xmat[geom].reshape(3, 3)[:, 2]
        assert field.value(data.geom_xpos[geom] + np.outer((-1, 0, 1), along)).min() > 1.5
    assert field.value(data.xpos[1] + (0, 0, 3)) < 1e-6
    # A sphere's skin is the sphere, where no other part is near: the top of the head.
    skull = model.geom("skull").id
    up = data.geom_xmat[skull].reshape(3, 3)[:, 2]
    assert field.value(data.geom_xpos[skull] + model.geom_size[skull, 0] * up) == pytest.approx(1.0, abs=0.02)


def test_a_skin_may_be_of_a_part_and_of_one_material():
    model = model_of(HUMANOID)
    moss = fs.Material("moss", blobbiness=-3.0)
    arm = fs.mujoco.skin(model, "left_arm", material=moss, swell=1.5)
    assert {body.surface.color for body in arm.bodies} == {"moss"}
    assert sorted(body.surface.radius for body in arm.bodies) == pytest.approx([0.0525, 0.06, 0.0675])
    assert len(fs.mujoco.Scene(fs.World(), model, skins=[arm]).geoms) == model.ngeom - 3


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"root": "tail"}, "no body 'tail'; it has 'pelvis', 'chest'"),
        ({"root": 99}, "no body 99"),
        ({"material": "moss"}, "material is 'moss'; give a fs.Material"),
        ({"swell": 0}, "swell is 0"),
    ],
)
def test_skins_that_cannot_be_are_refused(options, words):
    with pytest.raises(fs.InputError, match=words):
        fs.mujoco.skin(HUMANOID, **options)


def test_a_model_without_geoms_has_no_skin():
    with pytest.raises(fs.InputError, match="no geom to be seen that moves"):
        fs.mujoco.skin("<mujoco><worldbody><geom size='1'/></worldbody></mujoco>")
