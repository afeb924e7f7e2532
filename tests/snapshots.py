"""Do OVITO, VTK (ParaView) and NumPy read what packstone writes? Run by hand:

    python3 -m venv venv && venv/bin/pip install ovito vtk numpy
    packstone run examples/scenes/two_grains.toml --out bed --set 'output.formats=["csv", "vtp", "contacts.csv", "contacts.vtp", "npz", "xyz", "dump"]'
    venv/bin/python tests/snapshots.py bed

All have to find the same grains and contacts; the glyphs are spheres of the right size.
"""
import csv
import sys
from pathlib import Path

import numpy as np
from ovito.io import import_file
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkGlyph3D, vtkTubeFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

folder = Path(sys.argv[1])


def read(path):
    """PolyData of VTK, and its arrays at points and cells."""
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    assert reader.GetErrorCode() == 0 and data.GetNumberOfPoints() > 0, f"VTK has read nothing from {path}"
    time = data.GetFieldData().GetArray("TimeValue")
    assert time is not None and time.GetNumberOfTuples() == 1, "VTK has found no time"
    sides = [data.GetPointData(), data.GetCellData()]
    arrays = [{s.GetArrayName(k): vtk_to_numpy(s.GetArray(k)) for k in range(s.GetNumberOfArrays())} for s in sides]
    return data, *arrays, time.GetValue(0)


# Grains as points.
path = sorted(folder.glob("snapshot_*.vtp"))[-1]
data, vtk, _, time = read(path)
vtk["position"] = vtk_to_numpy(data.GetPoints().GetData())
assert data.GetNumberOfVerts() == data.GetNumberOfPoints()

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
drawn = vtk_to_numpy(glyph.GetOutput().GetPoints().GetData()).reshape(len(vtk["radius"]), -1, 3)
size = np.linalg.norm(drawn - vtk["position"][:, None, :], axis=2).max(axis=1)
assert np.allclose(size, vtk["radius"], rtol=1e-4), "glyphs have another size than grains"


def same(name, particles, radius="Radius", velocity="velocity"):
    """Particles of OVITO and points of VTK."""
    assert particles.count == len(vtk["radius"]), f"OVITO has {particles.count} particles in {name}, VTK {len(vtk['radius'])}"
    # Its reader of texts is off by a unit in the last place here and there.
    close = lambda a, b: np.allclose(a, b, rtol=1e-14, atol=0)
    assert close(particles.positions, vtk["position"]), f"{name}: other positions"
    # OVITO keeps radii in single precision.
    assert np.allclose(particles[radius], vtk["radius"], rtol=1e-6, atol=0), f"{name}: other radii"
    assert close(particles[velocity], vtk["velocity"]), f"{name}: other velocities"
    print(f"OVITO has {', '.join(particles.keys())} in {name}")


same(path.name, import_file(str(path)).compute().particles)
print(f"{len(vtk['radius'])} grains at {time} s, the same in VTK and OVITO")

# The same for NumPy, in extended XYZ and as a dump of LAMMPS, with their cell.
arrays = np.load(folder / "final.npz")
assert np.array_equal(arrays["position"], vtk["position"]) and np.array_equal(arrays["radius"], vtk["radius"])
assert np.array_equal(arrays["velocity"], vtk["velocity"]) and arrays["time"] == time
for name in ["final.xyz", "final.dump"]:
    frame = import_file(str(folder / name)).compute()
    same(name, frame.particles, velocity="Velocity")
    cell = frame.cell
    assert np.allclose(cell[:, :3].T, arrays["cell"]) and np.allclose(cell[:, 3], arrays["cell_origin"]), name
    assert np.array_equal(cell.pbc, arrays["periodic"]), f"{name}: {cell.pbc}, and not {arrays['periodic']}"

# Contacts: a table, lines, and NumPy's arrays.
with open(folder / "contacts.csv", newline="") as table:
    rows = list(csv.DictReader(table))
print(f"{len(rows)} contacts")
if rows:
    grain = np.array([int(row["grain"]) for row in rows])
    other = np.array([int(row["other"] or -1) for row in rows])
    part = lambda name: np.array([[float(row[f"{name}_{axis}"]) for axis in "xyz"] for row in rows])
    force = part("normal") + part("tangential")
    data, points, lines, _ = read(folder / "contacts.vtp")
    assert data.GetNumberOfLines() == len(rows) == len(arrays["contact_grain"])
    for found in [(lines["grain"], lines["other"], lines["force"]), tuple(arrays[f"contact_{k}"] for k in ["grain", "other", "force"])]:
        assert np.array_equal(found[0], grain) and np.array_equal(found[1], other)
        assert np.allclose(found[2], force, rtol=1e-12, atol=1e-12 * np.abs(force).max())
    ends = vtk_to_numpy(data.GetPoints().GetData()).reshape(-1, 2, 3)
    assert np.array_equal(ends[:, 0], arrays["position"][grain]), "lines begin at the first grain"
    along = ends[:, 1] - ends[:, 0]
    along /= np.linalg.norm(along, axis=1)[:, None]
    assert np.allclose(along, arrays["contact_normal"], atol=1e-9), "lines run along the normals"
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
print("the same in tables, VTK and NumPy")
