# SPDX-License-Identifier: MIT
"""Figure of mesh_layout.md."""
from svg import Figure

SIDE = 129  # samples of a chunk


def chunk_buffers():
    figure = Figure("chunk_buffers", 900, 430, "A chunk's samples, and the buffers on the device",
                    "Left: the samples of a chunk with their indices, and a triangle of three of them. Right: buffers: heights of chunks in slots, "
                    "kept; indices, offsets and draw calls, written each frame, with arrows from a draw call to its parts.")
    left, top, size, drawn = 60.0, 70.0, 240.0, 8
    step = size / drawn
    figure.text((20, 26), "a chunk: index = row * 129 + column", bold=True)
    for k in range(drawn + 1):
        figure.line((left + k * step, top), (left + k * step, top + size), "line-faint", 0.8)
        figure.line((left, top + k * step), (left + size, top + k * step), "line-faint", 0.8)
    corners = [(2, 2), (4, 4), (2, 4)]
    points = [(left + c * step, top + size - r * step) for c, r in corners]
    figure.polygon(points, "wash-blue")
    figure.polyline([*points, points[0]], "line-blue", 2.5)
    for column in range(drawn + 1):
        for row in range(drawn + 1):
            figure.circle((left + column * step, top + row * step), 2.6, "fill-ground", 0.0)
    for column, row, anchor in ((0, 0, "start"), (SIDE - 1, 0, "end"), (0, SIDE - 1, "start"), (SIDE - 1, SIDE - 1, "end")):
        x = left if column == 0 else left + size
        y = top + size + 22 if row == 0 else top - 10
        figure.text((x, y), str(row * SIDE + column), "ground", 15, anchor, bold=True)
    figure.text((left + size / 2, top + size + 22), "row 0: south", anchor="middle")
    figure.lines((20, 366), ["129 x 129 samples, drawn as 9 x 9;", "a triangle has three indices (blue)"])

    def strip(y, name, cells, role, marked, note):
        x, wide = 400.0, 470.0
        figure.text((x, y - 9), name, role, 15, bold=True)
        figure.text((x + wide, y - 9), note, size=13, anchor="end")
        total, at, box = sum(cells), x, None
        for i, share in enumerate(cells):
            span = wide * share / total
            if i == marked:
                figure.rectangle(at, y, span, 34, f"wash-{role}", 0.0)
                box = (at, span)
            figure.rectangle(at, y, span, 34, f"line-{role}", 1.5)
            at += span
        return box

    slot = strip(50, "heights", [1] * 6, "ground", 3, "once for each chunk: slots of 16,641")
    run = strip(165, "indices", [3, 5, 2, 4, 2], "blue", 1, "each frame: 3 for each triangle")
    moved = strip(280, "offsets", [1] * 4, "violet", 1, "each frame: chunks that morph")
    call = strip(380, "draw calls", [1] * 5, "ink", 1, "each frame: one for each chunk")
    x = call[0] + call[1] / 2
    for (at, span), y, shift in ((slot, 84, 30), (run, 199, -36), (moved, 314, -4)):
        goal = (at + span / 2, y)
        start = (x + shift, 380)
        figure.arrow(start, goal, "red", 1.8)
    return figure


def figures():
    return [chunk_buffers()]
