"""Load an IGES file through FreeCAD's importer and check what arrives.

Run by FreeCAD's own interpreter, which takes no arguments of its own:

    IGES_FILE=part.igs EXPECT_FACES=2 freecadcmd tests/judges/freecad_check.py

Prints one JSON line; exit code 0 when every face is valid (and there are as many as
EXPECT_FACES, if given), 1 otherwise.
"""

import json
import os
import sys

import FreeCAD

# The module Import, FreeCAD's other way in, reads colours too, but 0.20 dies of a
# segmentation fault on any coloured IGES file when it has no window.
import Part


def check():
    path = os.environ.get("IGES_FILE")
    if not path:
        return ["IGES_FILE is not set"], []
    document = FreeCAD.newDocument("judge")
    Part.insert(path, document.Name)
    document.recompute()
    shapes = [item.Shape for item in document.Objects if hasattr(item, "Shape")]
    faces = [face for shape in shapes for face in shape.Faces]
    problems = [f"face {k} is not valid" for k, face in enumerate(faces, 1) if not face.isValid()]
    loose = sum(len(s.Edges) for s in shapes if not s.Faces)
    if loose:
        problems.append(f"{loose} stray edges")
    expected = os.environ.get("EXPECT_FACES")
    if not faces or (expected is not None and len(faces) != int(expected)):
        problems.append(f"{len(faces)} faces instead of {expected or 'at least one'}")
    return problems, [{"area_mm2": face.Area, "edges": len(face.Edges)} for face in faces]


try:
    problems, found = check()
except Exception as error:  # FreeCAD would go on to an interactive prompt.
    problems, found = [repr(error)], []
print(json.dumps({"ok": not problems, "problems": problems, "faces": found}))
sys.stdout.flush()
os._exit(1 if problems else 0)
