"""What C++ offers, C offers. Usage: parity_test.py INCLUDE_FOLDER

Every function and field that C++'s public headers declare has its counterpart in clarus.h, by name or by the tables
below, which say what stands in for it."""
import os
import re
import sys
import unittest

FOLDER = os.path.join(sys.argv[1], "clarus")
CLASSES = {"Device": "device.h", "Model": "model.h", "Upscaler": "upscaler.h", "Interpolator": "interpolator.h"}
FUNCTIONS = {
    "Device::profile": "clarus_device_read_profile",
    "Device::profiles": "clarus_device_read_profile",
    "Device::context": None,  # of the library's own
    "Device::contexts": None,
    "Model::load": "clarus_model_find",
    "Model::filter": "clarus_model_find",
    "Model::options": "clarus_model_option",
    "Model::tensors": None,  # of the library's own
    "Upscaler::render_size": None,  # what the program said
    "Upscaler::memory_requirements": "clarus_upscaler_memory",
    "Upscaler::placement": "clarus_upscaler_part",
    "Interpolator::render_size": None,
    "Interpolator::output_size": None,  # what the program said; of a smaller frame, that of its upscaler
    "Interpolator::memory_requirements": "clarus_interpolator_memory",
}
FIELDS = {
    "color_space": "linear_color", "depth": "depth_projective", "motion": "motion_scale_x",
    "output_size": "output_width", "render_size": "render_width", "jitter": "jitter_x", "motion_scale": "motion_scale_x",
    "motion_size": "motion_width",
}
IMAGE_FIELDS = {"size": "width", "origin": "origin_x"}
# In clarus_frame, as an image.
FRAME_FIELDS = {"depth": "depth", "motion": "motion"}


def text_of(name):
    with open(os.path.join(FOLDER, name)) as file:
        text = re.sub(r"/\*.*?\*/", "", file.read(), flags=re.S)
    return re.sub(r"//.*", "", text)


def body(text, opening):
    """Between the braces that follow."""
    begin = text.index("{", text.index(opening)) + 1
    depth, end = 1, begin
    while depth:
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        end += 1
    return text[begin:end - 1]


def without_inner(text):
    while True:
        less = re.sub(r"\{[^{}]*\}", " ", text)
        if less == text:
            return text
        text = less


def fields_of(text, opening):
    statements = re.sub(r"struct \w+ +;", "", without_inner(body(text, opening))).split(";")
    names = []
    for statement in statements:
        declared = re.sub(r"=.*", "", re.sub(r"<[^;]*>", "", statement), flags=re.S).strip()
        if declared and "(" not in declared and not declared.startswith("struct"):
            names += re.findall(r"(\w+)\s*(?:,|$)", declared)
    return names


class Parity(unittest.TestCase):
    c = text_of("clarus.h")

    def test_functions(self):
        declared = set(re.findall(r"\b(clarus_\w+)\(", self.c))
        for name, header in CLASSES.items():
            public = re.sub(r"private:.*", "", body(text_of(header), f"class CLARUS_API {name} "), flags=re.S)
            methods = set(re.findall(r"[\w>&*] +[&*]?([a-z]\w*)\([^;{]*\)[^;{()]*[;{]", public)) - {"operator"}
            self.assertGreater(len(methods), 4, name)
            for method in methods:
                with self.subTest(f"{name}::{method}"):
                    expected = FUNCTIONS.get(f"{name}::{method}", f"clarus_{name.lower()}_{method}")
                    self.assertTrue(expected is None or expected in declared, expected)
        for header in ("device.h", "jitter.h", "log.h", "quality.h"):
            for function in re.findall(r"CLARUS_API [^;{]*?(\w+)\(", text_of(header)):
                self.assertIn(f"clarus_{function}", declared)
        self.assertIn("clarus_upscaler_invalid_motion_vectors", declared)

    def test_fields(self):
        stream = text_of("stream.h")
        for cpp, c, table in (
                (fields_of(stream, "struct StreamOptions "), "clarus_options", FIELDS),
                (fields_of(text_of("upscaler.h"), "struct UpscalerOptions "), "clarus_options", FIELDS),
                (fields_of(stream, "struct FrameParameters "), "clarus_frame", {**FIELDS, **FRAME_FIELDS}),
                (fields_of(stream, "struct FrameDescription "), "clarus_frame", {**FIELDS, **FRAME_FIELDS}),
                (fields_of(text_of("types.h"), "struct Image "), "clarus_image", IMAGE_FIELDS),
                (fields_of(text_of("device.h"), "struct DeviceProfile "), "clarus_device_profile", {})):
            self.assertGreater(len(cpp), 4)
            known = set(re.findall(r"\w+", body(self.c, f"typedef struct {c} ")))
            for field in cpp:
                with self.subTest(f"{c}.{field}"):
                    self.assertIn(table.get(field, field), known)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
