# SPDX-License-Identifier: MIT
"""Figure of store.md."""
import pathlib
import struct
import subprocess
import tempfile

import recordings as kept
from svg import Figure

# Fields of the directory: store.md.
LATTICE, CHUNK, PLACE = "<4d5i4dd", "<16s2d", "<QI"


def baked_file(program):
    """What the directory of a baked file lists. Needs the command zstd."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "jacksboro.terrane"
        subprocess.run([program, "bake", "--dem", str(kept.ROOT / "tools/data/jacksboro.tif"), "--seed", "7", "--detail-m", "20", "--out",
                        str(file)], check=True, stdout=subprocess.DEVNULL)
        data = file.read_bytes()
    begin, size = struct.unpack_from("<2Q", data, 16)
    directory = subprocess.run(["zstd", "-dc"], input=data[begin:begin + size], capture_output=True, check=True).stdout
    *lattice, finest, first_x, first_y, columns, rows, west, south, east, north, max_error = struct.unpack_from(LATTICE, directory)
    at = struct.calcsize(LATTICE) + 2 * (finest + 33) * 8
    assert directory[at] == 0  # a terrain with detail has no raster
    at += 1
    count = sum(columns * rows << 2 * level for level in range(finest + 1))
    heights = [struct.unpack_from(CHUNK, directory, at + i * struct.calcsize(CHUNK))[1:] for i in range(count)]
    at += count * struct.calcsize(CHUNK)
    at += 8 + struct.unpack_from("<Q", directory, at)[0]
    places = [struct.unpack_from(PLACE, directory, at + i * struct.calcsize(PLACE)) for i in range(count)]
    assert at + count * struct.calcsize(PLACE) == len(directory)
    side = lattice[2] * 128 * 2 ** finest
    return {"bytes": len(data), "directory": [begin, size], "levels": finest + 1, "roots": [columns, rows],
            "corner": [lattice[0] + first_x * side, lattice[1] + first_y * side], "root_size": side, "spacing": lattice[2],
            "extent": [west, south, east, north], "max_error_m": max_error,
            "chunks": [[*place, round(low, 1), round(high, 1)] for place, (low, high) in zip(places, heights)]}


def store_file():
    baked = kept.load("baked_file")
    columns, rows = baked["roots"]
    figure = Figure("store_file", 900, 470, "Levels of a baked terrain, and its file",
                    "Above: the chunks of three levels as squares over the terrain, darker where the ground is higher. Below: the file, "
                    "to scale: a header, the chunks level by level, and the directory.")
    lowest = min(chunk[2] for chunk in baked["chunks"])
    highest = max(chunk[3] for chunk in baked["chunks"])
    high, top, step, left = 232.0, 62.0, 290.0, 50.0
    scale = high / (rows * baked["root_size"])
    bar, bar_top, bar_high = 840.0, 388.0, 34.0
    first = 0
    for level in range(baked["levels"]):
        wide, deep = columns << level, rows << level
        chunks = baked["chunks"][first:first + wide * deep]
        x0, side = left + step * level, high / deep
        for i, (_, _, low, peak) in enumerate(chunks):
            x, y = x0 + i % wide * side, top + high - (i // wide + 1) * side
            share = (0.5 * (low + peak) - lowest) / (highest - lowest)
            figure.add("rect", "fill-ground", x=x, y=y, width=side, height=side, fill_opacity=0.1 + 0.8 * share)
            figure.rectangle(x, y, side, side, "line-page", 1.0)
            if level == 0:
                figure.text((x + side / 2, y + 18), str(i + 1), anchor="middle")
        corner, extent = baked["corner"], baked["extent"]
        figure.rectangle(x0 + (extent[0] - corner[0]) * scale, top + high - (extent[3] - corner[1]) * scale,
                         (extent[2] - extent[0]) * scale, (extent[3] - extent[1]) * scale, "line-blue", 2.0)
        spacing = baked["spacing"] * 2 ** (baked["levels"] - 1 - level)
        figure.text((x0, 24), f"level {level}", bold=True)
        figure.text((x0, 46), f"{len(chunks)} chunks, samples {spacing:g} m apart", size=13)
        begin, end = chunks[0][0], chunks[-1][0] + chunks[-1][1]
        a, b = (30 + bar * offset / baked["bytes"] for offset in (begin, end))
        figure.add("rect", "fill-ground", x=a, y=bar_top, width=b - a, height=bar_high, fill_opacity=(0.75, 0.5, 0.25)[level])
        for offset, _, _, _ in chunks[1:]:
            x = 30 + bar * offset / baked["bytes"]
            figure.line((x, bar_top), (x, bar_top + bar_high), "line-page", 0.6)
        figure.polygon([(x0, top + high + 5), (x0 + wide * side, top + high + 5), (b, bar_top - 4), (a, bar_top - 4)], "wash-ground")
        first += wide * deep
        if level:
            figure.text(((a + b) / 2, bar_top + bar_high + 20), f"level {level}: {(end - begin) / 1e6:.1f} MB", anchor="middle")
        else:
            figure.text((30, bar_top + bar_high + 20), f"{(end - begin) / 1e6:.1f} MB")
    figure.text((left + columns / rows * high + 6, 180), "extent", "blue")
    figure.lines((left + columns / rows * high + 6, 240), ["darker:", "higher ground"], "ground", 13)
    figure.rectangle(30, bar_top, bar, bar_high, "line-ink", 1.5)
    figure.text((30, bar_top + bar_high + 42), "header: 72 bytes")
    figure.text((870, bar_top + bar_high + 42), f"directory: {baked['directory'][1] / 1e3:.1f} kB", anchor="end")
    figure.text((450, bar_top + bar_high + 42), f"one file of {baked['bytes'] / 1e6:.1f} MB, to scale", anchor="middle")
    return figure


def recordings():
    return {"baked_file": baked_file}


def figures():
    return [store_file()]
