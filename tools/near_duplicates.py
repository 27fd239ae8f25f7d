"""Near-duplicates: pairs of runs of lines of code that are equal but for their names, numbers and strings."""

import collections
import io
import keyword
import tokenize

RUN = 6  # lines at least
COMMON = 8  # places at most of six lines of one shape: more are too common to tell

_SKIPPED = {"COMMENT", "NL", "NEWLINE", "INDENT", "DEDENT", "ENDMARKER"}


def near_duplicates(files):
    """(lines, place ~ place) of all pairs of runs in files, {path: text}, the longest first."""
    shapes = {path: _shapes(text) for path, text in files.items()}
    places = collections.defaultdict(list)
    for path, lines in shapes.items():
        for k in range(len(lines) - RUN + 1):
            places[tuple(shape for _, shape in lines[k : k + RUN])].append((path, k))
    starts = collections.defaultdict(set)
    for found in places.values():
        for i, (a, k) in enumerate(found if len(found) <= COMMON else ()):
            for b, m in found[i + 1 :]:
                if a != b or m - k >= RUN:
                    starts[a, b, m - k].add(k)
    runs = []
    for (a, b, offset), firsts in starts.items():
        for first in (k for k in firsts if k - 1 not in firsts):
            last = first
            while last + 1 in firsts:
                last += 1
            where = f"{a}:{shapes[a][first][0]} ~ {b}:{shapes[b][first + offset][0]}"
            runs.append((last - first + RUN, where))
    return sorted(runs, reverse=True)


def _shapes(text):
    """(line number, shape) of each line that does something: not of imports, brackets, and items of lists."""
    lines = collections.defaultdict(list)
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        kind = tokenize.tok_name[token.type]
        if kind not in _SKIPPED:
            is_plain = kind == "OP" or keyword.iskeyword(token.string)
            lines[token.start[0]].append(token.string if is_plain else kind)
    return [(n, tuple(line)) for n, line in lines.items() if len(line) > 2 and line[-1] != "," and "import" not in line]
