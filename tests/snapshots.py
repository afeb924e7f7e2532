"""Do OVITO and VTK (ParaView) read snapshots as they were written? Run by hand:

    python3 -m venv venv && venv/bin/pip install ovito vtk
    packstone run examples/scenes/two_grains.toml --out bed
    venv/bin/python tests/snapshots.py bed/snapshot_000000.vtp

Both have to find the same grains; the glyphs are spheres of the right size.
"""
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

path = sys.argv[1]

reader = vtkXMLPolyDataReader()
reader.SetFileName(path)
reader.Update()
data = reader.GetOutput()
assert reader.GetErrorCode() == 0 and data.GetNumberOfPoints() > 0, "VTK has read nothing"
arrays = {data.GetPointData().GetArrayName(k): k for k in range(data.GetPointData().GetNumberOfArrays())}
vtk = {name: vtk_to_numpy(data.GetPointData().GetArray(k)) for name, k in arrays.items()}
vtk["position"] = vtk_to_numpy(data.GetPoints().GetData())
time = data.GetFieldData().GetArray("TimeValue")
assert time is not None and time.GetNumberOfTuples() == 1, "VTK has found no time"
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

from ovito.io import import_file

frame = import_file(path).compute()
particles = frame.particles
assert particles.count == len(vtk["radius"]), f"OVITO has {particles.count} particles, VTK {len(vtk['radius'])}"
print("OVITO has", ", ".join(particles.keys()))
assert np.array_equal(particles.positions, vtk["position"])
# OVITO keeps radii in single precision.
assert np.allclose(particles["Radius"], vtk["radius"], rtol=1e-6, atol=0)
assert np.array_equal(particles["velocity"], vtk["velocity"])

print(f"{particles.count} grains at {time.GetValue(0)} s, the same in VTK and OVITO")
