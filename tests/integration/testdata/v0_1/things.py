"""Draws random objects of many shapes."""

import math

import rpc

LABELS = ["chair", "Dining Table", "cup", "potted plant", "Stuhl", "椅子", "a \"quoted\" word"]


def rectangle(x0, y0, x1, y1):
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def star(draw, x, y, radius, vertices):
    """Draws a simple ring around (x, y), convex or not, clockwise or counter-clockwise."""
    ring = []
    for i in range(vertices):
        angle = 2 * math.pi * (i + draw.uniform(0.1, 0.9)) / vertices
        r = radius * draw.uniform(0.5, 1.0)
        ring.append((x + r * math.cos(angle), y + r * math.sin(angle)))
    return ring if draw.random() < 0.5 else ring[::-1]


def polygon(outer, *holes):
    return {"outer": rpc.ring(outer), "holes": [rpc.ring(hole) for hole in holes]}


def shape(draw, x, y):
    """Draws a polygon of one of several kinds, which are stored, indexed or queried differently."""
    kind = draw.randrange(8)
    if kind == 0:
        return polygon(star(draw, x, y, draw.uniform(0.2, 2), draw.randint(3, 12)))
    if kind == 1:  # many vertices
        return polygon(star(draw, x, y, 1.5, draw.randint(60, 150)))
    if kind == 2:  # two holes
        return polygon(rectangle(x, y, x + 2, y + 1), rectangle(x + 0.2, y + 0.2, x + 0.8, y + 0.8),
                       star(draw, x + 1.5, y + 0.5, 0.4, 7))
    if kind == 3:  # the letter L
        return polygon([(x, y), (x + 1, y), (x + 1, y + 0.25), (x + 0.25, y + 0.25),
                        (x + 0.25, y + 1), (x, y + 1)])
    if kind == 4:  # a sliver
        return polygon([(x, y), (x + 3, y + 0.001), (x + 3, y + 0.002)])
    if kind == 5:  # a millimetre wide
        return polygon(rectangle(x, y, x + 0.001, y + 0.001))
    if kind == 6:  # on the lines between cells
        x, y = round(x), round(y)
        return polygon(rectangle(x, y, x + 1, y + 0.5))
    return polygon(star(draw, x, y, 1, 8), star(draw, x, y, 0.25, 5))


def thing(draw, x, y):
    """Draws the fields of an object near (x, y)."""
    label = draw.choice(LABELS)
    made = {"label": label, "polygon": shape(draw, x, y)}
    if draw.random() < 0.6:
        made["existence"] = draw.choice([0.0, 0.25, 1 / 3, draw.random(), 1.0])
        made["classes"] = {label: draw.random(), draw.choice(LABELS): 0.1}
    if draw.random() < 0.4:
        made["tags"] = draw.sample(["kitchen", "Büro", "to be checked", "x"], draw.randint(1, 3))
    if draw.random() < 0.4:
        low = draw.uniform(-0.5, 1)
        made["height"] = {"low_m": low, "high_m": low + draw.choice([0.0, 0.75, draw.random()])}
    if draw.random() < 0.5:
        made["attributes"] = {
            "movable": {"bool_value": draw.random() < 0.5},
            "asset": {"int_value": draw.choice([0, -7, 2**53 + 1, 2**63 - 1])},
            "weight_kg": {"double_value": draw.choice([2.0, 0.1, 1e-300, 1e22])},
            "näme": {"string_value": draw.choice(["", "a\nb", "back\\slash", "ärger"])}}
    return made
