"""Interrupts: none is lost, wherever Python is when it comes, and long launches are left soon."""

import ctypes
import signal
import sys
import threading
import time

import numpy as np
import pytest
import warp as wp

import fieldsim as fs
from fieldsim import interrupts
from fieldsim.dynamics import simulation as simulation_module
from fieldsim.launch import launch, loading


def interrupt():
    signal.raise_signal(signal.SIGINT)


class Destroyed:
    def __del__(self):
        interrupt()


def in_a_destructor():
    Destroyed()


def as_llvm_calls():
    def _raw_object_cache_notify():
        interrupt()

    ctypes.CFUNCTYPE(None)(_raw_object_cache_notify)()


def in_any_callback():
    ctypes.CFUNCTYPE(None)(interrupt)()


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("place", [interrupt, in_a_destructor, as_llvm_calls, in_any_callback])
@pytest.mark.parametrize("block", [interrupts.obeyed, loading])
def test_an_interrupt_is_obeyed_wherever_it_comes(place, block, monkeypatch):
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), block():
        place()
    assert interrupts.come() is None
    assert signal.getsignal(signal.SIGINT) is before


def test_where_python_would_lose_it_it_is_not_raised(monkeypatch):
    lost = []
    monkeypatch.setattr(sys, "unraisablehook", lost.append)
    for place in (in_a_destructor, as_llvm_calls):
        with pytest.raises(KeyboardInterrupt), interrupts.obeyed():
            place()
    assert lost == []


def test_an_error_does_not_hide_an_interrupt(monkeypatch):
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)

    @interrupts.obeyed()
    def fail(place):
        place()
        raise ValueError("alone")

    with pytest.raises(KeyboardInterrupt) as raised:
        fail(in_any_callback)
    assert isinstance(raised.value.__context__, ValueError)
    with pytest.raises(ValueError, match="alone"):
        fail(lambda: None)


def test_the_next_launch_raises_an_interrupt_that_was_lost(monkeypatch):
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)
    out = wp.zeros(1, dtype=int, device="cpu")

    @interrupts.obeyed()
    def run():
        in_any_callback()
        launch(_spin, 1, [1], [out], device="cpu")

    with pytest.raises(KeyboardInterrupt):
        run()
    assert out.numpy()[0] == 0


def test_what_waited_comes_once():
    """It is not raised again in what follows."""

    @interrupts.obeyed()
    def run():
        as_llvm_calls()
        interrupts.check()

    with pytest.raises(KeyboardInterrupt):
        run()
    time.sleep(0.1)


def test_what_is_being_kept_is_kept_first():
    for _ in range(2):
        done = []
        with pytest.raises(KeyboardInterrupt), interrupts.held():  # noqa: PT012
            interrupt()
            with interrupts.held():
                interrupt()
            done.append(1)
        assert done == [1]
    with interrupts.held():
        pass
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_signals_wait_for_so_long_only(monkeypatch):
    monkeypatch.setattr(interrupts, "_PATIENCE", 0.0)
    with pytest.raises(KeyboardInterrupt), interrupts.held():  # noqa: PT012
        interrupt()
        pytest.fail("held for ever")


def test_signals_that_follow_closely_are_one(monkeypatch):
    """What an interrupt unwinds is not interrupted itself."""
    with interrupts.heard("SIGINT"):
        with pytest.raises(KeyboardInterrupt):
            interrupt()
        interrupt()
        with pytest.raises(KeyboardInterrupt):
            interrupts.check()
        monkeypatch.setattr(interrupts, "_CLOSELY", 0.0)
        with pytest.raises(KeyboardInterrupt):
            interrupt()


def test_signals_that_are_ignored_or_taken_stay_so():
    mine = lambda *_: None  # noqa: E731
    for handler in (signal.SIG_IGN, mine):
        before = signal.signal(signal.SIGTERM, handler)
        try:
            with interrupts.heard("SIGTERM", "SIGNOTHERE"):
                assert signal.getsignal(signal.SIGTERM) is handler
        finally:
            signal.signal(signal.SIGTERM, before)


def test_other_threads_leave_signals_alone():
    failures = []

    def run():
        try:
            with interrupts.obeyed(), interrupts.heard("SIGTERM"):
                interrupts.check()
        except BaseException as error:
            failures.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    assert failures == []


@wp.kernel(enable_backward=False)
def _spin(start: int, turns: int, out: wp.array(dtype=int)):
    i = start + wp.tid()
    x = float(start)
    for _k in range(turns):
        x = wp.sin(x + 1.0)
    out[i] = wp.where(x > 2.0, 2, 1)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("grain", [1, 4096])
def test_a_long_launch_is_left_between_slices(threads, grain):
    out = wp.zeros(8000, dtype=int, device="cpu")
    launch(_spin, 1, [1], [out], device="cpu")  # compiled
    threading.Timer(0.3, lambda: signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        # Milliseconds an item: a minute in all.
        launch(_spin, len(out), [300_000], [out], device="cpu", threads=threads, grain=grain)
    done = out.numpy().sum()
    assert done < len(out) / 2
    # The threads have ended, too.
    launch(_spin, 1, [1], [out], device="cpu")
    assert out.numpy().sum() == done


@pytest.mark.parametrize("count", [1, 7, 511, 512, 5000])
@pytest.mark.parametrize("grain", [1, 16, 256])
@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_item_is_launched_once(count, grain, threads):
    out = wp.zeros(count, dtype=int, device="cpu")
    for _ in range(2):  # with and without knowing what items take
        launch(_count, count, [], [out], device="cpu", grain=grain, threads=threads)
    assert (out.numpy() == 2).all()


@wp.kernel(enable_backward=False)
def _count(start: int, out: wp.array(dtype=int)):
    i = start + wp.tid()
    out[i] = out[i] + 1


@pytest.mark.parametrize(("parts", "most"), [(1, 100_000), (10_000, 20), (10**9, 1)])
def test_slices_of_items_of_many_parts_are_small(monkeypatch, parts, most):
    """Even if the items before, or in the last launch, took next to no time."""
    sizes = []
    monkeypatch.setattr(wp, "launch", lambda kernel, dim, inputs, device: sizes.append(dim))
    for _ in range(2):
        launch(_count, 200, [], [], device="cpu", parts=parts)
    assert sum(sizes) == 400
    assert max(sizes) <= most


def test_an_error_in_a_launch_comes_through():
    with pytest.raises(RuntimeError):
        launch(_count, 2000, [], [wp.zeros(2000, dtype=float, device="cpu")], device="cpu", grain=1)


def _pulled(kind):
    """A world in which everything moves uniformly by 1 a unit of time, whatever acts, and at a time a motion fails."""
    failing = {}

    def motion(t):
        if t > failing.get("after", np.inf):
            raise failing["error"]
        return (0.0, 0.0, 1e6 + t)

    world = fs.World(escape_radius=1e5 if kind == "escape" else None)
    world.add_body(fs.Body(fs.Point((0, 0, 0)), gravity=fs.Newtonian(1.0), mass=1e-30, motion=motion))
    options = {"gravity": fs.Newtonian(1.0), "mass": 1e-30} if kind == "mutual" else {}
    if kind == "contact":
        world.add_body(fs.Body(fs.Point((0, 0, 1e4)), surface=fs.Material(radius=1.0)))
        options = {"contact": fs.Bounce()}
    if kind == "free":
        world.add_body(fs.Body(fs.Point((0, 0, 0)), mass=1.0, motion=fs.Rigid((0, 0, -1e4), velocity=(1, 0, 0))))
    world.add_particles(np.zeros((40, 3)), np.tile((1.0, 0, 0), (40, 1)), **options)
    return world, failing


@pytest.mark.parametrize("error", [KeyboardInterrupt, ZeroDivisionError])
@pytest.mark.parametrize("kind", ["plain", "escape", "contact", "free", "mutual"])
def test_a_run_that_is_broken_off_stands_at_one_time_and_goes_on(kind, error, monkeypatch):
    monkeypatch.setattr(simulation_module, "LAUNCH_STEPS", 8)
    world, failing = _pulled(kind)
    simulation = fs.Simulation(world, fs.Leapfrog(0.125))
    log = fs.EnergyLog(simulation)
    flown = simulation._fly

    def torn(*arguments):
        flown(*arguments)
        if simulation.time >= 4.0 and failing.pop("torn", False):
            raise error

    monkeypatch.setattr(simulation, "_fly", torn)
    failing["torn"] = True
    with pytest.raises(error):
        simulation.advance(8.0)

    def assert_together(time):
        assert simulation.time == time
        np.testing.assert_allclose(simulation.positions[0][:, 0], time, atol=1e-9)
        np.testing.assert_allclose(simulation.bodies.centers[:, 0], time, atol=1e-9)

    assert_together(4.0)
    failing.update(after=4.5, error=error("lost"))
    with pytest.raises(KeyboardInterrupt if error is KeyboardInterrupt else fs.InputError):
        simulation.advance(8.0)
    assert_together(4.0)
    failing.clear()
    simulation.advance(8.0)
    assert_together(8.0)
    log.record()
