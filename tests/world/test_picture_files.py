"""Files of pictures: their colours whatever their kind, and what is refused."""

import contextlib
import io
import os
import zlib

import numpy as np
import pytest
from PIL import Image

from fieldsim.errors import InputError
from fieldsim.world import pixels
from fieldsim.world.color import linear_of
from fieldsim.world.pixels import Pixels

COLORS = np.random.default_rng(0).integers(0, 256, (5, 7, 3), np.uint8)
SMOOTH = Image.fromarray(COLORS).resize((56, 40), Image.Resampling.BICUBIC)
KINDS = ["PNG", "JPEG", "GIF", "BMP", "TIFF", "WEBP", "PPM"]


def encoded(image, kind, **options):
    stream = io.BytesIO()
    image.save(stream, kind, **options)
    return stream.getvalue()


def srgb(path):
    """The picture of a file in 0..255."""
    linear = Pixels("it", path).linear.astype(float)
    return 255.0 * np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


@pytest.fixture
def stored(tmp_path):
    """A function from an image and a kind to the path of a file, whose name says nothing of it."""

    def store(image, kind, **options):
        path = tmp_path / "picture.xyz"
        path.write_bytes(encoded(image, kind, **options) if isinstance(image, Image.Image) else image)
        return path

    return store


HELD = {
    "RGB": KINDS,
    "RGBA": ["PNG", "TIFF", "WEBP"],
    "CMYK": ["JPEG", "TIFF"],
    "YCbCr": ["JPEG", "TIFF"],
    "P": ["PNG", "GIF", "BMP", "TIFF"],
    "L": ["PNG", "JPEG", "GIF", "BMP", "TIFF", "PPM"],
    "LA": ["PNG", "TIFF"],
    "1": ["PNG", "GIF", "BMP", "TIFF", "PPM"],
}


@pytest.mark.parametrize(("mode", "kind"), [(mode, kind) for mode, kinds in HELD.items() for kind in kinds])
def test_a_file_has_the_colours_that_it_shows(stored, mode, kind):
    right = SMOOTH.convert("1") if mode == "1" else SMOOTH.convert("L") if mode in ("L", "LA") else SMOOTH
    right = np.asarray(right.convert("RGB"), dtype=float)
    found = srgb(stored(SMOOTH.convert(mode), kind))
    # Palettes and losses of JPEG and WebP change single pixels, not the picture.
    assert np.abs(found - right).mean() < 20
    np.testing.assert_allclose(found.mean(axis=(0, 1)), right.mean(axis=(0, 1)), atol=8)


def test_print_colours_as_adobe_writes_them(stored):
    """Inverted, with a marker of its own."""
    path = stored(Image.new("CMYK", (16, 16), (60, 220, 60, 40)), "JPEG", quality=95)
    assert b"Adobe" in path.read_bytes()
    right = np.array(Image.new("CMYK", (1, 1), (60, 220, 60, 40)).convert("RGB").getpixel((0, 0)))
    np.testing.assert_allclose(srgb(path).mean(axis=(0, 1)), right, atol=4)
    assert right[0] > 100 > right[1]  # magenta


def test_sixteen_bits_of_grey_are_kept(stored):
    deep = (np.arange(40, dtype=np.uint16) * 1500).reshape(5, 8)
    for kind in ("PNG", "TIFF", "PPM"):
        found = Pixels("it", stored(Image.fromarray(deep), kind)).linear[..., 0]
        np.testing.assert_allclose(found, linear_of(deep / 65535), atol=1e-6)


def test_floats_of_a_file_are_srgb(stored):
    found = Pixels("it", stored(Image.fromarray(np.full((3, 4), 0.5, np.float32)), "TIFF")).linear
    np.testing.assert_allclose(found, linear_of(np.array(0.5)), atol=1e-6)
    with pytest.raises(InputError, match="has values from 7 to 7"):
        Pixels("it", stored(Image.fromarray(np.full((3, 4), 7, np.float32)), "TIFF")).linear  # noqa: B018


def test_transparency_is_left_out(stored):
    faint = Image.new("RGBA", (4, 4), (200, 100, 50, 3))
    for kind in ("PNG", "TIFF"):
        np.testing.assert_allclose(srgb(stored(faint, kind))[0, 0], (200, 100, 50), atol=0.5)
    indexed = Image.new("P", (4, 4), 1)
    indexed.putpalette([0, 0, 0, 200, 100, 50])
    np.testing.assert_allclose(srgb(stored(indexed, "PNG", transparency=b"\x07\x03"))[0, 0], (200, 100, 50), atol=0.5)


def test_an_animation_gives_its_first_frame(stored):
    frames = [Image.new("RGB", (6, 4), (80 * k, 0, 255 - 80 * k)) for k in range(3)]
    for kind in ("GIF", "PNG", "WEBP", "TIFF"):
        path = stored(frames[0], kind, save_all=True, append_images=frames[1:])
        np.testing.assert_allclose(srgb(path), np.tile((0, 0, 255), (4, 6, 1)), atol=3)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("kind", ["JPEG", "PNG", "WEBP", "TIFF"])
def test_exif_sets_a_picture_upright(stored, kind, orientation):
    upright = Image.new("RGB", (8, 16), "black")
    upright.paste("white", (0, 0, 8, 8))
    upright.paste("red", (0, 0, 4, 4))
    # What undoes a turn is itself, but for the quarters.
    turn = pixels.TURNS.get({6: 8, 8: 6}.get(orientation, orientation))
    exif = Image.Exif()
    exif[0x0112] = orientation
    path = stored(upright if turn is None else upright.transpose(turn), kind, exif=exif)
    found = srgb(path)
    assert found.shape == (16, 8, 3)
    assert np.abs(found - np.asarray(upright)).mean() < 20


@pytest.mark.parametrize("kind", KINDS)
def test_torn_files_are_refused(stored, kind):
    whole = encoded(SMOOTH, kind)
    right = Pixels("it", stored(whole, kind)).linear
    refused = 0
    for length in {*range(0, len(whole), max(len(whole) // 40, 1)), len(whole) - 1}:
        try:
            found = Pixels("it", stored(whole[:length], kind)).linear
        except InputError:
            refused += 1
        else:
            np.testing.assert_array_equal(found, right)
    assert refused >= 40


@pytest.mark.parametrize("kind", KINDS)
def test_damage_ends_in_plain_words_or_in_pixels(stored, kind):
    rng = np.random.default_rng(5)
    whole = np.frombuffer(encoded(SMOOTH, kind), np.uint8)
    for _ in range(60):
        bad = whole.copy()
        bad[rng.integers(0, len(bad) // 2, rng.integers(1, 9))] = rng.integers(0, 256)
        with contextlib.suppress(InputError):
            assert np.isfinite(Pixels("it", stored(bad.tobytes(), kind)).linear).all()


def test_a_flipped_bit_of_a_png_is_found(stored):
    whole = bytearray(encoded(SMOOTH, "PNG"))
    whole[len(whole) // 2] ^= 4
    with pytest.raises(InputError, match="is damaged or cut off"):
        Pixels("it", stored(bytes(whole), "PNG"))


def bomb(width, height):
    """A PNG of few bytes that stands for many pixels; as of one bit a pixel."""

    def chunk(name, data):
        return len(data).to_bytes(4, "big") + name + data + zlib.crc32(name + data).to_bytes(4, "big")

    header = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes((1, 0, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")


@pytest.mark.parametrize("size", [(20000, 20000), (8193, 8192), (2**31 - 1, 1), (10**5, 10**5)])
def test_more_pixels_than_fit_are_refused_by_the_header(stored, size):
    with pytest.raises(InputError, match=r"is (too large|of \d+x\d+ pixels); give one of at most 67 million pixels"):
        Pixels("it", stored(bomb(*size), "PNG"))


def test_arrays_have_the_same_limit():
    with pytest.raises(InputError, match="is of 8193x8192 pixels"):
        Pixels("it", np.broadcast_to(np.uint8(0), (8192, 8193, 3)))


@pytest.mark.parametrize(
    "content",
    [
        b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 10 10\n%%EndComments\nshowpage\n",
        b"\xc5\xd0\xd3\xc6" + bytes(60),  # PostScript with a header for DOS
        b"\xd7\xcd\xc6\x9a\x00\x00" + bytes(60),  # WMF
        b"GRIB" + bytes(60),
        b"",
        b"no picture at all",
        bytes(4096),
    ],
)
def test_other_kinds_are_no_pictures_and_start_no_programs(stored, tmp_path, monkeypatch, content):
    mark = tmp_path / "ran"
    for name in ("gs", "gswin64c", "djpeg", "convert"):
        (tmp_path / name).write_text(f"#!/bin/sh\ntouch {mark}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path) + os.pathsep + os.environ["PATH"])
    with pytest.raises(InputError, match=r"is no picture, or a damaged one; give one of PNG, JPEG"):
        Pixels("it", stored(content, ""))
    assert not mark.exists()


def test_names_that_are_no_files(tmp_path):
    for name, words in [
        (tmp_path, "there is no image"),
        (tmp_path / ("a" * 300), "there is no image"),
        ("a\0b.png", "give the path of a file"),
        ("\ud800.png", "give the path of a file"),
    ]:
        with pytest.raises(InputError, match=words):
            Pixels("it", name)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.png")
        with pytest.raises(InputError, match="there is no image"):
            Pixels("it", tmp_path / "pipe.png")


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (np.ma.masked_array(COLORS, COLORS > 9), "masked array"),
        (np.full((2, 2, 3), 1j), "is of type complex128"),
        (np.full((2, 2, 3), "red"), "is of type <U3"),
        (np.full((2, 2, 3), None), "is of type object"),
        (np.full((2, 2, 3), True), "is of type bool"),
        (np.full((2, 2, 3), -0.1), "has values from -0.1 to -0.1"),
        (np.full((2, 2, 3), np.inf), "4 pixels that are not finite"),
        (np.zeros((2, 2, 3), np.uint32), "is of type uint32"),
        (np.zeros((1, 2, 2, 3), np.uint8), r"has shape \(1, 2, 2, 3\)"),
        (None, r"has shape \(\)"),
    ],
)
def test_arrays_that_are_no_pictures(image, words):
    with pytest.raises(InputError, match=f"it: image .*{words}"):
        Pixels("it", image)


def test_arrays_of_any_byte_order():
    np.testing.assert_array_equal(
        Pixels("it", COLORS.astype(">u2") * 257).linear, Pixels("it", COLORS.astype("<u2") * 257).linear
    )


@pytest.mark.parametrize("mode", HELD)
def test_images_of_pillow_have_the_colours_that_they_show(stored, mode):
    image = SMOOTH.convert(mode)
    right = image.convert("RGB")
    np.testing.assert_array_equal(Pixels("it", image).linear, Pixels("it", np.asarray(right)).linear)
    with pytest.raises(InputError, match="it: image is of 8193x8192 pixels"):
        Pixels("it", Image.new("1", (8193, 8192)))
