"""How far a long measurement is, on standard error."""

import sys
import time

# Seconds between two words: on a terminal, where the line is written over, and elsewhere.
TERMINAL, ELSEWHERE = 0.5, 20.0


def progress(items, title: str, total: int | None = None):
    """Yield `items`, and say every now and then how many are done and how long the others will take."""
    total = len(items) if total is None else total
    on_terminal = sys.stderr.isatty()
    pause = TERMINAL if on_terminal else ELSEWHERE
    begun = said = time.monotonic()
    for done, item in enumerate(items):
        now = time.monotonic()
        if done and now - said > pause:
            said = now
            left = (now - begun) / done * (total - done)
            text = f"{title}: {done} of {total}, {now - begun:.0f} s, {left:.0f} s left"
            print(
                f"\r{text}\x1b[K" if on_terminal else text, end="" if on_terminal else "\n", file=sys.stderr, flush=True
            )
        yield item
    if on_terminal and said > begun:
        print("\r\x1b[K", end="", file=sys.stderr, flush=True)
