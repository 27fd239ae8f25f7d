"""Files of films: every legal name works and is a name, every rate plays in time, and wrong use ends in plain words."""

import contextlib
import math
import os
import re
import subprocess
import threading

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

import fieldsim as fs

BLACK = np.zeros((18, 32, 3), np.uint8)


def filmed(path, count=2, fps=10.0):
    with fs.Film(path, fps=fps) as film:
        for k in range(count):
            film.write(np.full_like(BLACK, 10 * k % 256))


def seconds_of_mp4(path):
    """How long it plays, and how many frames it has."""
    command = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", f"file:{path}", "-f", "rawvideo", "-fps_mode", "passthrough", "-"]
    done = subprocess.run(command, capture_output=True, check=True)
    hours, minutes, seconds = re.search(r"Duration: (\d+):(\d+):([\d.]+)", done.stderr.decode()).groups()
    frame = 18 * 32 * 3 // 2
    return int(hours) * 3600 + int(minutes) * 60 + float(seconds), len(done.stdout) // frame


def delays_of_gif(path):
    """Delays of the frames in milliseconds."""
    with Image.open(path) as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            found.append(image.info["duration"])
    return found


NAMES = [
    "2026-11-30T07:00",
    "take:1",
    "http:x",
    "pipe:1",
    "file:x",
    "concat:a|b",
    "-x",
    "-i",
    "100%",
    "a%d",
    "50%04d",
    'it\'s "quoted" & $HOME `x`;',
    "two\nlines",
    " spaces ",
    "Zürich 東京 🪐",
    "*?[ab]",
    "~",
    "a\\b",
    "x" * 251,
    "é" * 125,
    "\udcff",  # a name in no encoding
]


@pytest.mark.parametrize("ending", ["mp4", "gif"])
@pytest.mark.parametrize("name", NAMES)
def test_every_legal_name_is_a_name(tmp_path, monkeypatch, name, ending):
    monkeypatch.chdir(tmp_path)
    filmed(f"{name}.{ending}")
    assert os.listdir() == [f"{name}.{ending}"]
    assert os.path.getsize(f"{name}.{ending}") > 100


@pytest.mark.parametrize("folder", ["a:b", "http:", "100%", "-y"])
def test_every_legal_folder_is_one(tmp_path, monkeypatch, folder):
    monkeypatch.chdir(tmp_path)
    os.mkdir(folder)
    for name in ("a.mp4", "b.gif", "c.png", "frames/"):
        filmed(f"{folder}/{name}")
    assert sorted(os.listdir(folder)) == ["a.mp4", "b.gif", "c.png", "frames"]


def test_sequences_of_odd_names(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("100%/", "a:b_%d.png", "two\nlines_%02d.png"):
        filmed(name)
    assert sorted(os.listdir()) == ["100%", "a:b_0.png", "a:b_1.png", "two\nlines_00.png", "two\nlines_01.png"]
    assert sorted(os.listdir("100%")) == ["frame_0000.png", "frame_0001.png"]


def test_links_are_replaced_and_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_bytes(b"precious")
    (tmp_path / "frames").mkdir()
    for name in ("a.mp4", "a.gif", "a.png", "frames/frame_0000.png", "shot_0000.png"):
        (tmp_path / name).symlink_to(victim)
    for name in ("a.mp4", "a.gif", "a.png", "frames/", "shot_%04d.png"):
        filmed(f"{tmp_path}/{name}")
    assert victim.read_bytes() == b"precious"
    assert not any(path.is_symlink() for path in tmp_path.rglob("*"))


def test_a_folder_in_the_way_of_a_frame(tmp_path):
    (tmp_path / "frames" / "frame_0001.png").mkdir(parents=True)
    with pytest.raises(fs.FilmError, match=r"frame_0001\.png is a folder"):
        filmed(tmp_path / "frames", count=3)
    (tmp_path / "frames" / "frame_0000.png").unlink(missing_ok=True)
    (tmp_path / "frames" / "frame_0000.png").mkdir()
    with pytest.raises(fs.InputError, match="this is a folder"):
        fs.Film(tmp_path / "frames")


@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "a.png", "frames/", "shot_%d.png", "."])
@pytest.mark.parametrize("fails", [False, True])
def test_a_film_stays_where_it_began(tmp_path, monkeypatch, name, fails):
    """Whatever the working folder is by its end."""
    for folder in ("here", "there"):
        (tmp_path / folder).mkdir()
    monkeypatch.chdir(tmp_path / "here")
    with contextlib.suppress(ZeroDivisionError), fs.Film(name) as film:
        film.write(BLACK)
        os.chdir(tmp_path / "there")
        film.write(BLACK)
        assert 1 / (not fails)
    assert not any((tmp_path / "there").iterdir())
    assert [path.name[0] for path in (tmp_path / "here").iterdir()] != ["."]
    assert any((tmp_path / "here").iterdir()) != (fails and name == "a.png")


@pytest.mark.parametrize("name", ["a.gif", "frames/"])
def test_threads_may_write_one_film(tmp_path, name):
    with fs.Film(f"{tmp_path}/{name}") as film:
        threads = [threading.Thread(target=lambda: [film.write(BLACK) for _ in range(10)]) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    found = len(list((tmp_path / name).iterdir())) if name == "frames/" else len(delays_of_gif(tmp_path / name))
    assert film.frames == found == 40


@pytest.mark.parametrize("count", [1, 2, 24, 61])
@pytest.mark.parametrize("fps", [0.5, 10, 14, 24, 30, 49.9, 50, 59.94, 60, 75, 100, 144, 240, 1000])
def test_gifs_play_in_time(tmp_path, fps, count):
    filmed(tmp_path / "a.gif", count, fps)
    delays = delays_of_gif(tmp_path / "a.gif")
    assert min(delays) >= 20
    assert abs(sum(delays) - 1000 * count / fps) <= max(20.0, 1000 / fps)
    assert len(delays) == (count if fps <= 50 else max(round(50 * count / fps), 1))


@pytest.mark.parametrize("fps", [0.01, 0.3, 1, 23.976, 29.97, 59.94, 120, 240, 1000])
def test_mp4s_play_in_time(tmp_path, fps):
    filmed(tmp_path / "a.mp4", 7, fps)
    seconds, count = seconds_of_mp4(tmp_path / "a.mp4")
    assert count == 7
    # ffmpeg tells hundredths.
    assert seconds == pytest.approx(7 / fps, rel=1e-3, abs=0.01)


@pytest.mark.parametrize("fps", [0, -1, 1e-4, 1001, 1e300, math.inf, math.nan, "30", None, 30j, [30, 31]])
@pytest.mark.parametrize("name", ["a.mp4", "a.gif", "a.png", "frames/"])
def test_rates_that_no_film_has(tmp_path, name, fps):
    with pytest.raises(fs.InputError, match="Film: fps is"):
        fs.Film(f"{tmp_path}/{name}", fps=fps)


@pytest.mark.parametrize(
    "size", [(math.inf, 4), (math.nan, 4), ("4", "4"), "44", (4, 4, 4), (4j, 4), None, 7, [[4], [4]]]
)
def test_sizes_that_no_film_has(tmp_path, size):
    if size is not None:
        with pytest.raises(fs.InputError, match="Film: size is"):
            fs.Film(tmp_path / "a.mp4", size=size)


@pytest.mark.parametrize(
    ("image", "words"),
    [
        ([[1, 2], [3]], "rows of different lengths"),
        (np.zeros((0, 4, 3), np.uint8), r"size is \(4, 0\)"),
        (np.broadcast_to(np.uint8(0), (1, 20000, 3)), r"size is \(20000, 1\)"),
        (np.ma.masked_array(BLACK, True), "a masked array"),
        (BLACK.astype(np.int8), "of int8"),
        (BLACK[..., :1], r"shape \(18, 32, 1\)"),
        (None, r"shape \(\) of object"),
    ],
)
def test_images_that_are_none(tmp_path, image, words):
    with fs.Film(tmp_path / "a.png") as film:
        film.write(BLACK)
        with pytest.raises(fs.InputError, match=rf"Film\.write: .*{words}"):
            film.write(image)


@pytest.mark.parametrize("name", ["a.mp4", "a.png", "frames/"])
def test_films_used_wrongly(tmp_path, name):
    path = f"{tmp_path}/{name}"
    film = fs.Film(path)
    for wrong in (lambda: film.write(BLACK), lambda: film.__exit__(None, None, None)):
        with pytest.raises(fs.FilmError, match="the film is not open; write inside"):
            wrong()
    with film:
        film.write(BLACK)
        with pytest.raises(fs.FilmError, match="is open already"):
            film.__enter__()
        film.write(BLACK)
    with pytest.raises(fs.FilmError, match="the film is not open"):
        film.write(BLACK)
    assert film.frames == 2
    # Left by an error without having been entered: the error is the user's own.
    assert not fs.Film(path).__exit__(KeyError, KeyError("own"), None)
    assert [name for name in os.listdir(tmp_path) if name.startswith(".")] == []


def test_without_an_encoder(tmp_path, monkeypatch):
    def none():
        raise RuntimeError("No ffmpeg exe could be found.")

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", none)
    with pytest.raises(fs.FilmError, match="No ffmpeg exe could be found"):
        filmed(tmp_path / "a.mp4")
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("out", "options", "words"),
    [
        ("a.mp4", {"fps": 1e300}, "Film: fps is"),
        ("a.mp4", {"fps": 1e-300}, "Film: fps is"),
        ("a.mp4", {"size": (1e9, 1)}, "film: size is"),
        ("a.mp4", {"size": "big"}, "film: size is"),
        ("a" * 300 + ".mp4", {}, "File name too long"),
        ("nowhere/a.mp4", {"duration": 1e15}, "does not exist"),
    ],
)
def test_a_film_is_refused_before_any_work(tmp_path, out, options, words):
    world = fs.World()

    def motion(t):
        pytest.fail("the world was asked where it is")

    world.add_body(fs.Body(fs.Point((0, 0, 0)), surface=fs.Material(), motion=motion))
    scenario = fs.Scenario(world, fs.Camera((0, -5, 1)), duration=1.0, fps=10)
    with pytest.raises(fs.InputError, match=words):
        fs.film(scenario, tmp_path / out, **options)
    assert os.listdir(tmp_path) == []


def test_a_folder_takes_frames_where_nothing_around_it_may_be_written(tmp_path, monkeypatch):
    """As one that is another disk's."""
    target = tmp_path / "frames"
    target.mkdir()
    made = []
    real = os.replace
    monkeypatch.setattr(os, "replace", lambda one, other: (made.append(one), real(one, other)))
    filmed(target)
    assert len(made) == 2
    assert all(target in path.parents for path in made)
    assert sorted(os.listdir(target)) == ["frame_0000.png", "frame_0001.png"]
