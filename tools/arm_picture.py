# Copyright 2026 hysteresis_ros contributors
# SPDX-License-Identifier: Apache-2.0
"""
Render the arm's URDF, as RViz shows it with the markers, into a picture: `arm_picture.py arm.png`.

Needs xacro, yourdfpy and matplotlib (extra `test`). The forearms of target and prediction and the
muscles, which are no links, are drawn between the frames of the description.
"""

import io
from pathlib import Path
import sys

import matplotlib
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection
import numpy as np
import trimesh
import xacro
import yourdfpy

DESCRIPTION = Path(__file__).resolve().parents[1] / 'urdf' / 'bicep.urdf.xacro'
# Angle [rad], colour and width of each forearm that is drawn as a line.
FOREARMS = {'target': (1.70, '#269e40', 7.0), 'predicted': (1.90, '#e6801a', 3.0)}
MEASURED = 1.80
SUN = np.array([0.35, -0.8, 0.5])


def shape(geometry):
    """Return a primitive of a URDF as a mesh."""
    if geometry.box is not None:
        return trimesh.creation.box(geometry.box.size).subdivide().subdivide().subdivide()
    if geometry.cylinder is not None:
        mesh = trimesh.creation.cylinder(
            geometry.cylinder.radius, geometry.cylinder.length, sections=32)
        # Long faces would be sorted wrongly from front to back.
        return mesh.subdivide_to_size(0.02)
    return trimesh.creation.icosphere(subdivisions=3, radius=geometry.sphere.radius)


def surfaces(robot):
    """Return the triangles of all links, shape (n, 3, 3), and their colours, shape (n, 3)."""
    materials = {material.name: material.color.rgba[:3] for material in robot.robot.materials}
    triangles, colours = [], []
    for name, link in robot.link_map.items():
        for visual in link.visuals:
            mesh = shape(visual.geometry)
            place = robot.get_transform(name, 'base_link')
            mesh.apply_transform(place if visual.origin is None else place @ visual.origin)
            light = 0.55 + 0.45 * np.clip(mesh.face_normals @ SUN / np.linalg.norm(SUN), 0.0, 1.0)
            triangles.append(mesh.triangles)
            colours.append(np.outer(light, materials[visual.material.name]))
    return np.concatenate(triangles), np.concatenate(colours)


def draw(axes, robot):
    """Draw the links, the forearms of target and prediction, and the muscles."""
    def place(link, angle):
        robot.update_cfg({'elbow': angle})
        return robot.get_transform(link, 'base_link')[:3, 3]
    for name, (angle, colour, width) in FOREARMS.items():
        tip = place('payload', angle)
        axes.add_collection3d(Line3DCollection(
            [[(0.0, 0.0, 0.0), tip]], colors=colour, linewidths=width, alpha=0.7))
        axes.text(*(1.12 * tip), name, color=colour, fontsize=11)
    anchor, clamp = place('anchor', MEASURED), place('clamp', MEASURED)
    sides = [np.array([0.0, y, 0.0]) for y in (-0.008, 0.0, 0.008)]
    axes.add_collection3d(Line3DCollection(
        [[anchor + side, clamp + side] for side in sides], colors='#bf2626', linewidths=1.5))
    axes.text(*(1.12 * place('payload', MEASURED)), 'measured',
              color='#335999', fontsize=11)
    triangles, colours = surfaces(robot)
    axes.add_collection3d(Poly3DCollection(triangles, facecolors=colours))


def main(path):
    """Write the picture."""
    robot = yourdfpy.URDF.load(
        io.StringIO(xacro.process_file(str(DESCRIPTION)).toxml()), load_meshes=False)
    figure = Figure(figsize=(6.0, 4.4))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), projection='3d')
    axes.set_axis_off()
    draw(axes, robot)
    axes.set(xlim=(-0.04, 0.36), ylim=(-0.2, 0.2), zlim=(-0.12, 0.28))
    axes.set_box_aspect((1.0, 1.0, 1.0), zoom=1.55)
    axes.view_init(elev=14.0, azim=-68.0)
    figure.savefig(path, dpi=110, facecolor='white')
    return 0


if __name__ == '__main__':
    matplotlib.use('Agg')
    sys.exit(main(sys.argv[1]))
