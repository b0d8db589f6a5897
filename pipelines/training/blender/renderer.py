"""Blender's Cycles as a sampler: one ray a pixel at a known place, with the position and object that it met."""

import os
import tempfile

import bpy
import numpy as np
import OpenEXR

import sampling
import scenes


def write(path, image):
    """[h, w, c], as half floats where it is colour; appears whole."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    planes = {c: np.ascontiguousarray(image[..., i]) for i, c in enumerate("RGB" if image.shape[2] == 3 else "RG"[: image.shape[2]])}
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    whole = f"{path}.part.exr"
    OpenEXR.File(header, planes).write(whole)
    os.replace(whole, path)


class Renderer:
    def __init__(self, film, size, far):
        bpy.ops.wm.read_factory_settings(use_empty=True)
        self.size, self.far, self.references = size, far, {}
        self.set_to = scenes.FILMS[film]()
        scene = bpy.context.scene
        scene.world = bpy.data.worlds.new("black")
        scene.world.use_nodes = False
        scene.world.color = (0, 0, 0)
        scene.render.engine = "CYCLES"
        cycles = scene.cycles
        cycles.samples, cycles.use_adaptive_sampling, cycles.use_denoising = 1, False, False
        cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", 0.01
        cycles.max_bounces = 0
        scene.render.use_persistent_data = True
        scene.render.threads_mode, scene.render.threads = "FIXED", 2
        scene.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
        scene.render.image_settings.color_depth = "32"
        layer = bpy.context.view_layer
        layer.use_pass_position = layer.use_pass_object_index = True
        for i, made in enumerate(o for o in scene.objects if o.type in ("MESH", "CURVE", "FONT")):
            made.pass_index = i + 1

    def matrices(self, t):
        """Sets the scene at a moment; matrices by object index, the camera's at 0."""
        self.set_to(t)
        bpy.context.view_layer.update()
        scene = bpy.context.scene
        found = {o.pass_index: np.array(o.matrix_world) for o in scene.objects if o.pass_index}
        found[0] = np.array(scene.camera.matrix_world)
        return found

    def sample(self, width, height, shift=(0, 0)):
        """Colour, position and index by channel name; `shift` in pixels, y down."""
        scene = bpy.context.scene
        scene.render.resolution_x, scene.render.resolution_y = width, height
        scene.render.resolution_percentage = 100
        scene.camera.data.shift_x, scene.camera.data.shift_y = shift[0] / width, -shift[1] / width
        with tempfile.TemporaryDirectory() as folder:
            scene.render.filepath = os.path.join(folder, "frame.exr")
            bpy.ops.render.render(write_still=True)
            channels = OpenEXR.File(scene.render.filepath, separate_channels=True).channels()
            planes = {name: channel.pixels for name, channel in channels.items()}

        def plane(*suffixes):
            return np.stack([next(p for n, p in planes.items() if n.endswith(s)) for s in suffixes], 2)

        return (plane("Combined.R", "Combined.G", "Combined.B"), plane("Position.X", "Position.Y", "Position.Z"),
                plane("IndexOB.X")[..., 0])

    def frame(self, t, before, jitter, scale, grid, paths):
        """Writes the images of moment `t`, whose preceding moment is `before`."""
        width, height = self.size
        earlier, now = self.matrices(before), self.matrices(t)
        camera = bpy.context.scene.camera.data
        focal = width * camera.lens / camera.sensor_width

        def buffers(points, indices):
            return sampling.motion_and_depth(points, indices, now, earlier, focal, self.size, self.far)

        colour, points, indices = self.sample(width, height, jitter)
        motion, depth = buffers(points, indices)
        _, points, indices = self.sample(width * scale, height * scale)
        reference_motion, reference_depth = buffers(points, indices)
        if t not in self.references:
            fine = self.sample(width * scale * grid, height * scale * grid)[0]
            self.references = {t: sampling.box_mean(sampling.encoded(fine), grid)}
        images = {"color": sampling.encoded(colour), "depth": depth[..., None], "motion": motion,
                  "reference": self.references[t], "reference_depth": reference_depth[..., None],
                  "reference_motion": reference_motion}
        for name, image in images.items():
            write(paths[name], image.astype(np.float16 if name in ("color", "reference") else np.float32))
