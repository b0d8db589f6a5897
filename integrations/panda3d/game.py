#!/usr/bin/env python3
"""A game on Panda3D that shares its frames, with the motion of everything that moves: game.py NAME

Drawn without a window. What sharing adds to a game is `SHADER`, `describe`, and what is after `render_frame` in `main`.
"""

import argparse
import math
import os
import signal
import sys

from panda3d.core import LMatrix4f, loadPrcFileData

loadPrcFileData("", "load-display p3headlessgl\ntextures-power-2 none\naudio-library-name null\nnotify-level warning")
from direct.showbase.ShowBase import ShowBase  # noqa: E402
from panda3d.core import (  # noqa: E402
    FrameBufferProperties,
    GraphicsOutput,
    GraphicsPipe,
    PerspectiveLens,
    Shader,
    Texture,
    WindowProperties,
)

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import clarus_share  # noqa: E402
import numpy as np  # noqa: E402

# `now` and `before` are the cameras', `back` takes a thing's points in the world to where they were a frame ago.
SHADER = Shader.make(
    Shader.SL_GLSL,
    """#version 150
    uniform mat4 p3d_ModelMatrix, now, before, back;
    uniform vec2 jitter;
    in vec4 p3d_Vertex, p3d_Color;
    in vec3 p3d_Normal;
    in vec2 p3d_MultiTexCoord0;
    out vec4 tint, clip, clip_before;
    out vec2 uv;
    void main() {
        vec4 place = p3d_ModelMatrix * p3d_Vertex;
        clip = now * place;
        clip_before = before * (back * place);
        gl_Position = clip + vec4(jitter * clip.w, 0, 0);
        vec3 normal = normalize(mat3(p3d_ModelMatrix) * p3d_Normal + vec3(0, 0, 1e-4));
        tint = vec4(p3d_Color.rgb * (0.7 + 0.3 * dot(normal, normalize(vec3(1, -2, 3)))), p3d_Color.a);
        uv = p3d_MultiTexCoord0;
    }""",
    """#version 150
    uniform sampler2D p3d_Texture0;
    uniform vec4 p3d_ColorScale;
    uniform vec2 size;
    uniform float detail;
    in vec4 tint, clip, clip_before;
    in vec2 uv;
    out vec4 outputs[2];
    void main() {
        vec4 color = texture(p3d_Texture0, uv, detail) * tint * p3d_ColorScale;
        if (color.a < 0.5) discard;
        vec2 motion = (clip_before.xy / clip_before.w - clip.xy / clip.w) * size * vec2(0.5, -0.5);
        outputs[0] = vec4(color.rgb, 1);
        outputs[1] = vec4(0, motion.yx, 0);  // the second texture lies in memory as blue, green, red
    }""",
)


def halton(index, base):
    value, digit = 0.0, 1.0
    while index:
        digit /= base
        value += digit * (index % base)
        index //= base
    return value


class Game(ShowBase):
    """A world with things that walk, turn and fly."""

    def __init__(self, width, height):
        super().__init__(windowType="offscreen")
        buffer = FrameBufferProperties()
        buffer.set_rgba_bits(8, 8, 8, 8)
        buffer.set_depth_bits(32)
        buffer.set_float_depth(True)
        buffer.set_aux_float(1)
        options = GraphicsPipe.BF_refuse_window
        size = WindowProperties.size(width, height)
        output = self.graphics_engine.make_output(self.pipe, "frame", 0, buffer, size, options, self.win.gsg, self.win)
        if not output:
            raise SystemExit("game: no OpenGL: Panda3D draws without a window by EGL (libegl1, libgl1-mesa-dri)")
        planes = GraphicsOutput.RTP_color, GraphicsOutput.RTP_depth, GraphicsOutput.RTP_aux_float_0
        self.textures = [Texture() for _ in planes]
        for texture, plane in zip(self.textures, planes):
            output.add_render_texture(texture, GraphicsOutput.RTM_bind_or_copy, plane)
        self.textures[2].set_component_type(Texture.T_float)  # else bytes
        self.textures[2].set_format(Texture.F_rgba32)
        self.lens = PerspectiveLens()
        self.lens.set_film_size(width / height, 1)
        self.lens.set_fov(75)
        self.lens.set_near_far(0.5, 400)
        self.eye = self.make_camera(output, lens=self.lens)
        self.render.set_shader(SHADER)
        self.render.set_shader_inputs(size=(width, height), back=LMatrix4f.ident_mat())

        ground = self.add("models/environment", 0.25)
        ground.set_pos(-8, 42, 0)
        self.sky = self.add("models/box", 300)
        self.sky.set_texture_off(1)
        self.sky.set_two_sided(True)
        self.sky.set_color_scale(0.45, 0.65, 0.9, 1)
        self.panda = self.add("models/panda-model", 0.005)
        self.teapot = self.add("models/teapot", 0.8)
        self.crates = [self.add("models/box", 1.3) for _ in range(4)]
        self.places = {}

    def add(self, model, scale):
        added = self.loader.load_model(model)
        added.reparent_to(self.render)
        added.set_scale(scale)
        return added

    def move(self, frame):
        t = frame / 30
        self.eye.set_pos(10 * math.sin(0.25 * t), -16 + 3 * math.sin(0.4 * t), 4 + 0.5 * math.sin(0.6 * t))
        self.eye.look_at(0, 4, 2)
        self.sky.set_pos(self.eye.get_pos() - 150)
        self.panda.set_pos(5 * math.sin(t), 5 * math.cos(t), 0)
        self.panda.set_h(-math.degrees(t) - 90)
        self.teapot.set_pos(0, 0, 1)
        self.teapot.set_h(90 * t)
        for index, crate in enumerate(self.crates):
            crate.set_pos(3 * index - 4.5, -4, 2 * abs(math.sin(2 * t + index)))
            crate.set_hpr(90 * t, 150 * t, 0)

    def tell_motion(self, jitter):
        """Gives shaders this frame's places and those of the one before."""
        view = self.render.get_mat(self.eye) * self.lens.get_projection_mat()
        before = self.places.get("view", view)
        self.render.set_shader_inputs(now=view, before=before, jitter=jitter)
        self.places["view"] = LMatrix4f(view)
        for thing in [self.sky, self.panda, self.teapot, *self.crates]:
            place = LMatrix4f(thing.get_mat(self.render))
            was = self.places.get(thing, place)
            inverse = LMatrix4f()
            inverse.invert_from(place)
            thing.set_shader_input("back", inverse * was)
            self.places[thing] = place

    def images(self):
        """Colour, depth and motion, rows from the top."""
        for texture, kind, order in zip(self.textures, (np.uint8, np.float32, np.float32), ("RGBA", None, None)):
            self.graphics_engine.extract_texture_data(texture, self.win.gsg)
            memory = texture.get_ram_image_as(order) if order else texture.get_ram_image()
            yield np.frombuffer(memory, kind).reshape(texture.get_y_size(), texture.get_x_size(), -1)[::-1]


def describe(width, height, scale):
    description = clarus_share.library().clarus_share_default_description()
    for kind, type_, channels in (
        (clarus_share.COLOR, 0, 4),
        (clarus_share.DEPTH, 2, 1),
        (clarus_share.MOTION, 2, 4),
    ):
        description.resources[kind] = clarus_share.Resource(clarus_share.Format(type_, channels), width, height, 0)
    description.depth_projective = 1
    description.motion_sampled_at_jitter = 1
    description.scale = scale
    return description


def main():
    parser = argparse.ArgumentParser(description="A game on Panda3D that shares its frames.")
    parser.add_argument("name", help="of the stream")
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--size", default="480x270")
    parser.add_argument("--scale", type=float, default=2, help="of what is shown over what is rendered")
    arguments = parser.parse_args()
    width, height = map(int, arguments.size.split("x"))
    signal.signal(signal.SIGTERM, lambda *_: sys.exit())  # so that the stream is closed
    game = Game(width, height)
    game.render.set_shader_input("detail", -math.log2(arguments.scale))
    with clarus_share.Stream(arguments.name, describe(width, height, arguments.scale)) as stream:
        for number in range(arguments.frames):
            x, y = halton(number % 16 + 1, 2) - 0.5, halton(number % 16 + 1, 3) - 0.5
            game.move(number)
            game.tell_motion((-2 * x / width, 2 * y / height))
            game.graphics_engine.render_frame()
            frame = stream.begin()
            for kind, image in enumerate(game.images()):
                frame.images[kind].array()[:] = image
            frame.number = number
            frame.jitter_x, frame.jitter_y = x, y
            frame.near_plane, frame.far_plane = game.lens.near, game.lens.far
            frame.reset = number == 0
            stream.end(frame)


if __name__ == "__main__":
    main()
