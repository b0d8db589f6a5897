"""The films, built from primitives: a function a film, which returns what sets the scene at a moment (in frames).

Surfaces are lit by one sun without extent and a constant share of their own colour, so that a single sample has no noise.
Textures are unfiltered functions of position, as sharp as any mip bias would make them.
"""

import math

import bpy


def material(name, colour, other=None, kind=None, scale=4.0, ambient=0.35):
    """`colour`, or a pattern of it and `other`: BrickTexture, CheckerTexture, NoiseTexture; in object coordinates."""
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    nodes.clear()
    diffuse, emission = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeEmission")
    added, output = nodes.new("ShaderNodeAddShader"), nodes.new("ShaderNodeOutputMaterial")
    emission.inputs["Strength"].default_value = ambient
    links.new(diffuse.outputs[0], added.inputs[0])
    links.new(emission.outputs[0], added.inputs[1])
    links.new(added.outputs[0], output.inputs["Surface"])
    for shader in (diffuse, emission):
        shader.inputs["Color"].default_value = (*colour, 1)
    if kind:
        coordinates, pattern = nodes.new("ShaderNodeTexCoord"), nodes.new(f"ShaderNodeTex{kind}")
        pattern.inputs["Scale"].default_value = scale
        links.new(coordinates.outputs["Object"], pattern.inputs["Vector"])
        result = pattern.outputs[0]
        if kind == "Noise":
            ramp = nodes.new("ShaderNodeValToRGB")
            ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (*colour, 1), (*other, 1)
            ramp.color_ramp.elements[0].position, ramp.color_ramp.elements[1].position = 0.4, 0.6
            links.new(result, ramp.inputs[0])
            result = ramp.outputs[0]
        else:
            pattern.inputs["Color1"].default_value, pattern.inputs["Color2"].default_value = (*colour, 1), (*other, 1)
        for shader in (diffuse, emission):
            links.new(result, shader.inputs["Color"])
    return made


def placed(surface, at=(0, 0, 0), turn=(0, 0, 0), scale=(1, 1, 1), parent=None):
    made = bpy.context.object
    made.data.materials.append(surface)
    made.location, made.rotation_euler, made.scale, made.parent = at, turn, scale, parent
    return made


def box(surface, at, size, **given):
    """`size`: edge lengths; the pattern is not stretched."""
    bpy.ops.mesh.primitive_cube_add(size=1)
    made = placed(surface, at, **given)
    for vertex in made.data.vertices:
        vertex.co = [c * s for c, s in zip(vertex.co, size)]
    return made


def ball(surface, at, radius):
    bpy.ops.mesh.primitive_uv_sphere_add(radius=radius, segments=48, ring_count=24)
    return placed(surface, at)


def rod(surface, at, radius, length, turn=(0, 0, 0), parent=None):
    """A cylinder along z before it is turned."""
    bpy.ops.mesh.primitive_cylinder_add(radius=radius, depth=length, vertices=20)
    return placed(surface, at, turn, parent=parent)


def text(surface, words, at, size, parent=None):
    """Print that faces −y."""
    bpy.ops.object.text_add()
    bpy.context.object.data.body, bpy.context.object.data.size = words, size
    return placed(surface, at, (math.pi / 2, 0, 0), parent=parent)


def wheel(surface, rim, at, radius, spokes):
    """In the plane of x and z; a handle to turn about y."""
    bpy.ops.object.empty_add()
    hub = bpy.context.object
    hub.location = at
    bpy.ops.mesh.primitive_torus_add(major_radius=radius, minor_radius=radius / 14, major_segments=64)
    placed(rim, turn=(math.pi / 2, 0, 0), parent=hub)
    for i in range(spokes):
        rod(surface, (0, 0, 0), radius / 60, 2 * radius, (0, math.pi * i / spokes, 0), hub)
    return hub


def mesh(surface, at, width, height, pitch, parent=None):
    """Chain-link: crossing diagonal wires in the plane of x and z, as one object."""
    wires = bpy.data.curves.new("wires", "CURVE")
    wires.dimensions, wires.bevel_depth, wires.bevel_resolution = "3D", 0.008, 1
    count = int((width + height) / pitch)
    for i in range(count):
        for mirror in (1, -1):
            first = i * pitch
            low, high = max(0, first - width), min(height, first)
            spline = wires.splines.new("POLY")
            spline.points.add(1)
            for point, z in zip(spline.points, (low, high)):
                point.co = (mirror * (first - z - width / 2), 0, z, 1)
    made = bpy.data.objects.new("mesh", wires)
    bpy.context.collection.objects.link(made)
    bpy.context.view_layer.objects.active = made
    return placed(surface, at, parent=parent)


def setting(camera_at, turn, lens, sun_turn, strength):
    bpy.ops.object.light_add(type="SUN")
    sun = bpy.context.object
    sun.data.angle, sun.data.energy, sun.rotation_euler = 0, strength, sun_turn
    bpy.ops.object.camera_add()
    camera = bpy.context.object
    camera.location, camera.rotation_euler, camera.data.lens = camera_at, turn, lens
    camera.data.clip_end = 500
    bpy.context.scene.camera = camera
    return camera


def workshop():
    """A room: things that move on their own before brick and print, and a camera that stands still."""
    setting((0, -7, 1.6), (math.pi / 2, 0, 0), 28, (0.7, 0.35, 0), 2.2)
    brick = material("brick", (0.42, 0.12, 0.07), (0.3, 0.08, 0.05), "Brick", 3)
    wood = material("wood", (0.35, 0.2, 0.08), (0.2, 0.1, 0.04), "Noise", 9)
    steel, dark = material("steel", (0.6, 0.62, 0.65)), material("dark", (0.02, 0.02, 0.025))
    red, yellow = material("red", (0.85, 0.02, 0.02)), material("yellow", (0.9, 0.65, 0.02))
    floor = material("floor", (0.3, 0.3, 0.28), (0.12, 0.13, 0.14), "Checker", 2)
    # A brick pattern lies in x and y of its object: the wall is a slab that is set upright.
    box(brick, (0, 2, 3), (16, 9, 0.2), turn=(math.pi / 2, 0, 0))
    box(floor, (0, -3, -0.55), (16, 12, 0.1))
    for z in (2.6, 3.5):
        box(wood, (-2.6, 1.6, z), (3.4, 0.6, 0.07))
        for i in range(7):
            tool = (steel, red, yellow, dark)[i % 4]
            rod(tool, (-4 + 0.45 * i, 1.5, z + 0.3), 0.03 + 0.02 * (i % 3), 0.5)
    text(yellow, "WORKSHOP No. 27\nmind the moving parts", (0.6, 1.85, 3.5), 0.3)
    for i in range(5):
        rod(dark, (3 + 0.25 * i, 1, 3), 0.008, 5, (0, 0.06 * i, 0))
    mesh(steel, (3.4, -1, -0.4), 2.4, 2.2, 0.18)
    spinning = wheel(steel, dark, (-2.3, 0.6, 0.9), 1.1, 9)
    crate = box(material("crate", (0.75, 0.7, 0.6)), (0, 0.2, 0), (1.3, 0.8, 0.9))
    text(dark, "FRAGILE\nthis way up", (-0.55, -0.405, 0.1), 0.28, crate)
    rolling = ball(material("ball", (0.9, 0.02, 0.02), (0.95, 0.9, 0.9), "Checker", 2.5), (0, -1.6, -0.05), 0.45)
    pendulums = []
    for i in range(3):
        bpy.ops.object.empty_add()
        pivot = bpy.context.object
        pivot.location = (0.3 + 0.8 * i, -0.4, 4.6)
        rod(dark, (0, 0, -1.2), 0.012, 2.4, parent=pivot)
        ball((yellow, red, steel)[i], (0, 0, -2.4), 0.2).parent = pivot
        pendulums.append(pivot)
    near = rod(dark, (0, -5.4, 1), 0.05, 6)

    def at(t):
        spinning.rotation_euler = (0, 0.13 * t, 0)
        crate.location.x = -1.6 + 0.17 * t
        rolling.location.x = 3 - 0.2 * t
        rolling.rotation_euler = (0, -0.2 * t / 0.45, 0)
        near.location.x = -1.2 + 0.07 * t
        for i, pivot in enumerate(pendulums):
            pivot.rotation_euler = (0, 0.5 * math.sin(0.22 * t + i), 0)

    return at


def courtyard():
    """Columns, railings, foliage and a flag in the open, past which the camera pans and moves."""
    camera = setting((0, -9, 1.7), (math.pi / 2, 0, 0), 26, (0.9, -0.4, 0), 3)
    stone = material("stone", (0.62, 0.56, 0.45), (0.42, 0.38, 0.3), "Noise", 6)
    tiles = material("tiles", (0.5, 0.45, 0.4), (0.22, 0.2, 0.22), "Checker", 1.5)
    wall = material("wall", (0.6, 0.5, 0.35), (0.5, 0.38, 0.25), "Brick", 2)
    iron, white = material("iron", (0.03, 0.04, 0.04)), material("white", (0.85, 0.85, 0.8))
    sky = material("sky", (0.2, 0.42, 0.8), ambient=1)
    box(sky, (0, 60, 20), (300, 1, 160))
    box(tiles, (0, 0, -0.05), (60, 40, 0.1))
    box(wall, (0, 9, 2), (40, 4.5, 0.3), turn=(math.pi / 2, 0, 0))
    for i in range(-6, 7):
        rod(stone, (2.2 * i, 4, 1.8), 0.28, 3.6)
        box(stone, (2.2 * i, 4, 3.65), (0.8, 0.8, 0.2))
    box(stone, (0, 4, 3.95), (32, 0.9, 0.4))
    for i in range(-50, 51):
        rod(iron, (0.2 * i, 0, 0.5), 0.012, 1)
    rod(iron, (0, 0, 1), 0.025, 20, (0, math.pi / 2, 0))
    mesh(iron, (5, 1, 0), 3, 2.4, 0.2)
    leaves = [material(f"leaf {i}", (0.05 + 0.06 * i, 0.3 + 0.1 * i, 0.03)) for i in range(3)]
    for i in range(160):
        # Low-discrepancy places in a bush: a fixed arrangement, without a random number.
        u, v, w = (i * 0.8191) % 1, (i * 0.6711) % 1, (i * 0.5497) % 1
        box(leaves[i % 3], (-4.5 + 2 * u, 1.5 + v, 0.2 + 1.8 * w), (0.22, 0.01, 0.12), turn=(6 * u, 6 * v, 6 * w))
    text(iron, "MUSEUM  open 9-17", (-2, 8.8, 3.0), 0.5)
    rod(white, (2, 2, 2.5), 0.03, 5)
    bpy.ops.object.empty_add()
    flag = bpy.context.object
    flag.location = (2, 2, 4.3)
    for i in range(5):
        box((white, material("blue", (0.02, 0.05, 0.7)))[i % 2], (0.8, 0, 0.15 * i), (1.6, 0.02, 0.15), parent=flag)
    cart = box(material("cart", (0.95, 0.3, 0.02)), (0, 2.4, 0.6), (1.2, 0.5, 0.8))
    text(white, "ICE", (-0.45, -0.255, -0.2), 0.6, cart)
    near = rod(iron, (1, -7, 1), 0.05, 8)

    def at(t):
        camera.location.x = -1.5 + 0.06 * t
        camera.rotation_euler.z = 0.2 - 0.014 * t
        cart.location.x = 3.2 - 0.3 * t
        flag.rotation_euler = (0, 0, 0.5 * math.sin(0.3 * t))
        near.location.x = 0.9 - 0.02 * t

    return at


FILMS = {"workshop": workshop, "courtyard": courtyard}
