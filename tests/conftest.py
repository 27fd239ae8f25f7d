"""What all tests share: the quick ones, the long ones, and options that make this machine another one."""

import signal
import textwrap
import threading

import pytest

# Files whose tests a newcomer runs after an edit: every floor of the house, in under 90 seconds with kernels cached.
QUICK = {
    "test_bad_input", "test_camera", "test_diagnostics", "test_fields", "test_fields_reference", "test_formulas",
    "test_holes", "test_house", "test_integrators", "test_mesh", "test_pixels", "test_portable", "test_published",
    "test_recording", "test_sampling", "test_simulation", "test_skeletons", "test_special_functions", "test_world",
}  # fmt: skip


def pytest_addoption(parser):
    parser.addoption(
        "--all", action="store_true", help="run the long tests, too (marked full); for CUDA, compile as for a GPU"
    )
    parser.addoption(
        "--cpu-target", help="compile Warp's kernels for this processor, such as haswell, instead of the one here"
    )
    parser.addoption("--threads", type=int, help="launch Warp's kernels on so many threads, instead of one a core")


def pytest_configure(config):
    # What a shell runs in the background is deaf to Ctrl-C, what `nohup` runs to a closed terminal, and so are the
    # processes that either starts; unlike ignoring, handlers of our own are not handed on.
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.default_int_handler)
        if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) == signal.SIG_IGN:
            signal.signal(signal.SIGHUP, lambda number, frame: None)
    target, threads = config.getoption("--cpu-target"), config.getoption("--threads")
    if threads:
        from fieldsim import launch

        launch.THREADS = threads
    if target:
        import warp as wp

        wp.config.cpu_compiler_flags = wp.config.cpu_compiler_flags.replace("-march=native", f"-target-cpu {target}")


def pytest_collection_modifyitems(config, items):
    for item in items:
        if item.path.stem in QUICK and not item.get_closest_marker("full"):
            item.add_marker(pytest.mark.quick)
        if item.get_closest_marker("full") and not config.getoption("--all"):
            item.add_marker(pytest.mark.skip(reason="a long test: give --all"))


@pytest.fixture
def compiles_for_cuda(request, tmp_path, monkeypatch):
    """A check that a Warp module, or the one so named, compiles to PTX; it needs no GPU.

    What a kernel may not say is found before it is optimised. Warp's own optimisation for CUDA, which `--all` asks for,
    compiles large kernels in half a minute each; a level lower, in a few seconds.
    """
    import warp as wp

    def check(module):
        folder = tmp_path / str(len(list(tmp_path.iterdir())))
        with monkeypatch.context() as patch:
            if not request.config.getoption("--all"):
                patch.setattr(wp.config, "optimization_level", 2)
            wp.compile_aot_module(module, arch=90, use_ptx=True, module_dir=str(folder))
        (ptx,) = folder.glob("*.ptx")
        assert ".entry" in ptx.read_text()

    return check


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with scenarios/planet.py, to work in by the command line."""
    from commands import PLANET

    from fieldsim import files

    files.appeared.clear()
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios" / "planet.py").write_text(textwrap.dedent(PLANET))
    return tmp_path
