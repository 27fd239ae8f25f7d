"""What is installed here: versions, devices and the cache of compiled kernels."""

import os
import pathlib
import platform
from importlib import metadata

PACKAGES = ("fieldsim", "numpy", "warp-lang", "numba", "mujoco", "pillow", "imageio", "imageio-ffmpeg")


def report() -> str:
    """A table, one line each."""
    import imageio_ffmpeg
    import warp as wp

    from fieldsim import launch

    wp.init()
    rows = [("python", f"{platform.python_version()} on {platform.platform(terse=True)}")]
    rows += [(name, _version(name)) for name in PACKAGES]
    rows.append(("encoder", f"ffmpeg {imageio_ffmpeg.get_ffmpeg_version()}"))
    for device in wp.get_devices():
        size = f"{device.total_memory / 2**30:.0f} GiB" if device.is_cuda else f"{launch.THREADS} threads"
        rows.append(("device", f"{device.alias}: {device.name}, {size}"))
    rows.append(("kernel cache", _cache(pathlib.Path(wp.config.kernel_cache_dir))))
    width = max(len(name) for name, _ in rows)
    return "\n".join(f"{name:<{width}}  {text}" for name, text in rows)


def _version(name):
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "not installed"


def _cache(folder):
    """Path and size of the kernel cache."""
    files = [os.path.join(where, name) for where, _, names in os.walk(folder) for name in names]
    total = sum(os.path.getsize(file) for file in files)
    return f"{folder} ({total / 2**20:.0f} MiB in {len(files)} files; safe to delete)"
