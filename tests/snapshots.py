"""Do OVITO, VTK (ParaView) and NumPy read what packstone writes? Run by hand:

    python3 -m venv venv && venv/bin/pip install ovito vtk numpy
    venv/bin/python tests/snapshots.py target/release/packstone

It runs small scenes (walls, a cell that is sheared, disks, clumps) in every format, and looks at each moment of each. All
have to find the same grains, cells and contacts; the glyphs are spheres of the right size. OVITO has no reader for lines of
VTK, so contacts are for the others.
"""
import csv
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml
from pathlib import Path

import numpy as np
from ovito.io import import_file
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkGlyph3D, vtkTubeFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

COMMON = """
seed = 5
[material."soft glass"]
density = 2500
normal_stiffness = 1e3
friction = 0.4
restitution = 0.5
[[population]]
material = "soft glass"
count = 150
radius = { uniform = [0.8e-3, 1.2e-3] }
%s
[solver]
damping = 20
[output]
snapshots = 0.01
formats = ["csv", "vtp", "contacts.csv", "contacts.vtp", "npz", "xyz", "dump"]
"""
FLOOR = """
[[wall]]
kind = "box"
name = "bin"
material = "soft glass"
lower = %s
upper = %s
faces = [%s]
"""
IN_A_BIN = FLOOR % ("[-0.005, 0, 0]", "[0.007, 0.01, 1]", '"x-", "x+", "y-", "y+", "z-"')
SCENES = {
    "bin": "dimension = 3\nstop.time = 0.05\n" + COMMON % "" + IN_A_BIN,
    "clumps": "dimension = 3\nstop.time = 0.05\n" + COMMON % 'shape = "rod"' + IN_A_BIN,
    "disks": "dimension = 2\nstop.time = 0.05\n" + COMMON.replace("1e3", "1e6") % "" + FLOOR % ("[0, 0]", "[0.02, 1]", '"x-", "x+", "y-"'),
    "sheared": "dimension = 3\ngravity = [0, 0, 0]\nstop.time = 0.02\n" + COMMON % 'placement = "random"' + """
[domain]
lower = [-0.005, 0, 0.002]
upper = [0.007, 0.012, 0.014]
boundary = "periodic"
[cell]
strain_rate = { xy = 20, yz = -15, xz = 10, zz = -20 }
""",
}


def polydata(path):
    """Of VTK: its arrays at points and cells, and its time."""
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    assert reader.GetErrorCode() == 0, f"VTK cannot read {path}"
    time = data.GetFieldData().GetArray("TimeValue")
    assert time is not None and time.GetNumberOfTuples() == 1, "VTK has found no time"
    sides = [data.GetPointData(), data.GetCellData()]
    arrays = [{s.GetArrayName(k): vtk_to_numpy(s.GetArray(k)) for k in range(s.GetNumberOfArrays())} for s in sides]
    return data, *arrays, time.GetValue(0)


def grains_of_vtk(path):
    """Grains as points."""
    data, grains, _, time = polydata(path)
    grains["position"] = vtk_to_numpy(data.GetPoints().GetData())
    assert data.GetNumberOfVerts() == data.GetNumberOfPoints() > 0
    # What the filter Glyph of ParaView does: its sphere has the radius 0.5, so `radius` with a factor of 2.
    sphere = vtkSphereSource()
    sphere.SetThetaResolution(64)
    sphere.SetPhiResolution(65)
    glyph = vtkGlyph3D()
    glyph.SetInputData(data)
    glyph.SetSourceConnection(sphere.GetOutputPort())
    glyph.SetInputArrayToProcess(0, 0, 0, 0, "radius")
    glyph.SetScaleModeToScaleByScalar()
    glyph.SetScaleFactor(2.0)
    glyph.Update()
    drawn = vtk_to_numpy(glyph.GetOutput().GetPoints().GetData()).reshape(len(grains["radius"]), -1, 3)
    size = np.linalg.norm(drawn - grains["position"][:, None, :], axis=2).max(axis=1)
    assert np.allclose(size, grains["radius"], rtol=1e-4), "glyphs have another size than grains"
    return grains, time


def same(path, grains, velocity):
    """Particles of OVITO and points of VTK."""
    frame = import_file(str(path)).compute()
    particles = frame.particles
    assert particles.count == len(grains["radius"]), f"{path}: OVITO has {particles.count} particles"
    # Its reader of texts is off by a unit in the last place here and there.
    close = lambda a, b: np.allclose(a, b, rtol=1e-14, atol=0)
    assert close(particles.positions, grains["position"]), f"{path}: other positions"
    # OVITO keeps radii in single precision.
    assert np.allclose(particles["Radius"], grains["radius"], rtol=1e-6, atol=0), f"{path}: other radii"
    assert close(particles[velocity], grains["velocity"]), f"{path}: other velocities"
    return frame


def contacts(table, lines, arrays):
    """A table, lines, and NumPy's arrays."""
    with open(table, newline="") as file:
        rows = list(csv.DictReader(file))
    data, _, found, _ = polydata(lines)
    assert data.GetNumberOfLines() == len(rows) == len(arrays["contact_grain"])
    if not rows:
        return 0
    grain = np.array([int(row["grain"]) for row in rows])
    other = np.array([int(row["other"] or -1) for row in rows])
    part = lambda name: np.array([[float(row[f"{name}_{axis}"]) for axis in "xyz"] for row in rows])
    force = part("normal") + part("tangential")
    for ours in [found, {key: arrays[f"contact_{key}"] for key in ["grain", "other", "force"]}]:
        assert np.array_equal(ours["grain"], grain) and np.array_equal(ours["other"], other)
        assert np.allclose(ours["force"], force, rtol=1e-12, atol=1e-12 * np.abs(force).max())
    ends = vtk_to_numpy(data.GetPoints().GetData()).reshape(-1, 2, 3)
    assert np.array_equal(ends[:, 0], arrays["position"][grain]), "lines begin at the first grain"
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    assert np.allclose(along, arrays["contact_normal"], atol=1e-9), "lines run along the normals"
    # To the other grain, or to one of its images in the cell.
    pairs = other >= 0
    to_other = arrays["position"][other[pairs]] - ends[pairs, 1]
    images = np.linalg.solve(arrays["cell"].T, to_other.T).T
    assert np.allclose(images, np.round(images), atol=1e-6), "lines end at the other grain"
    # Force chains: the filter Tube of ParaView.
    tube = vtkTubeFilter()
    tube.SetInputData(data)
    tube.SetInputArrayToProcess(0, 0, 0, 0, "normal_force")
    tube.SetRadius(0.1 * arrays["radius"].min())
    tube.SetVaryRadiusToVaryRadiusByScalar()
    tube.Update()
    assert tube.GetOutput().GetNumberOfStrips() + tube.GetOutput().GetNumberOfPolys() > 0, "no force chains"
    # What the arrays say of walls follows from the contacts.
    for wall, name in enumerate(arrays["wall_name"]):
        on_wall = -arrays["contact_force"][arrays["contact_wall"] == wall].sum(axis=0)
        scale = np.abs(arrays["contact_force"]).max()
        assert np.allclose(on_wall, arrays["wall_force"][wall], atol=1e-9 * scale), name
    return len(rows)


def check(folder):
    """All that there is of all moments. The series for ParaView has every one, the last one included."""
    series = [entry.attrib for entry in xml.parse(folder / "packstone.pvd").iter("DataSet")]
    assert [entry["file"] for entry in series] == sorted(path.name for path in folder.glob("snapshot_*.vtp"))
    seen, tilted = 0, False
    for number, entry in enumerate(series):
        grains, time = grains_of_vtk(folder / entry["file"])
        assert float(entry["timestep"]) == time
        same(folder / entry["file"], grains, "velocity")
        last = number + 1 == len(series)
        name = "final" if last else f"snapshot_{number:06}"
        arrays = np.load(folder / f"{name}.npz")
        ours = "" if "clump_position" not in arrays else "member_"
        for key in ["position", "radius", "velocity"]:
            found = arrays[ours + key] if ours + key in arrays else arrays[key]
            assert np.array_equal(found, grains[key]), f"{name}.npz: other {key}"
        assert arrays["time"] == time
        for ending in ["xyz", "dump"]:
            path = folder / f"{name}.{ending}"
            cell = same(path, grains, "Velocity").cell
            assert np.allclose(cell[:, :3].T, arrays["cell"]) and np.allclose(cell[:, 3], arrays["cell_origin"]), path
            assert np.array_equal(cell.pbc, arrays["periodic"]), f"{path}: {cell.pbc}, and not {arrays['periodic']}"
        tilted |= bool(np.any(arrays["cell"] != np.diag(np.diag(arrays["cell"]))))
        beginning = "contacts" if last else f"contacts_{number:06}"
        seen += contacts(folder / f"{beginning}.csv", folder / f"{beginning}.vtp", arrays)
    print(f"{folder.name}: {len(series)} moments, {len(grains['radius'])} grains, {seen} contacts, the same in all")
    return seen, tilted


with tempfile.TemporaryDirectory() as place:
    place = Path(place)
    for name, text in SCENES.items():
        (place / f"{name}.toml").write_text(text)
        command = [sys.argv[1], "run", place / f"{name}.toml", "--out", place / name, "--engine", "cpu", "--quiet"]
        subprocess.run(command, check=True)
        seen, tilted = check(place / name)
        assert seen > 0 and tilted == (name == "sheared"), "the scenes show what they are for"
