"""The moving picture of a run: table, gimbals and instrument turn as its record says."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from nicegui import ui

from gyrobench.arrays import Array
from gyrobench.frames import pole
from gyrobench.record.record import Record
from gyrobench.studio.frame import PageSeen
from gyrobench.studio.words import say, spoken
from gyrobench.system.moving_bodies import MovingBody, attitudes

AXES = ("#d03030", "#1f8f3a", "#2f6fd0")  # x, y, z of every body
ALONG = ((0.0, 0.0, -np.pi / 2.0), (0.0, 0.0, 0.0), (np.pi / 2.0, 0.0, 0.0))  # turns a rod, which lies along y
THICK = 0.014
SHADES = ("#9aa7b4", "#b9a37c", "#8fae8b", "#a58fb0", "#7c9cb9")
#: of names, which lie over lines and bodies
NAMED = "color: var(--soft); font-size: 13px; text-shadow: 0 0 2px var(--panel), 0 0 4px var(--panel)"
SIZE = 2.6  # of the outermost body; each that stands on it is smaller
FRAMES = 400  # of a whole record while it plays
TICK = 0.1  # s between two frames
#: the front end's own call turns by Euler angles, whose extraction loses digits near 90 degrees; a quaternion does not
#: what is newest counts, and what is not there yet is waited for
TURN = """(() => {
  const turns = %s, place = %d;
  (window.bodiesTurned ??= {})[place] = turns;
  const turn = left => {
    if (window.bodiesTurned[place] !== turns) return;
    const objects = getElement(place)?.objects;
    let waiting = !objects;
    for (const [id, r] of objects ? turns : []) {
      const mesh = objects.get(id)?.mesh;
      if (!mesh) { waiting = true; continue; }
      const m = mesh.matrix.clone();
      m.set(r[0][0], r[1][0], r[2][0], 0, r[0][1], r[1][1], r[2][1], 0, r[0][2], r[1][2], r[2][2], 0, 0, 0, 0, 1);
      mesh.setRotationFromMatrix(m);
    }
    if (waiting && left > 0) setTimeout(() => turn(left - 1), 50);
  };
  turn(200);
})()"""


BREADTH = 1.3  # width / height of a view that holds the names at the ends of east and north
#: the front end draws 20 frames a second whatever there is to see: those that show the same, or nothing, are left out
CALM = """(() => {
  const calm = left => {
    const place = getElement(%d), draws = [place?.renderer, place?.text_renderer, place?.text3d_renderer];
    if (!draws.every(Boolean)) { if (left > 0) setTimeout(() => calm(left - 1), 50); return; }
    let last = '', changed = 0;
    place.framesDrawn = 0;
    draws[0].setClearAlpha(0);  // the ground is that of the page
    const draw = draws.map(d => d.render.bind(d));
    draws[0].render = (scene, camera) => {
      const { offsetParent, clientWidth, clientHeight } = place.$el;
      if (!offsetParent) return;
      camera.zoom = Math.min(1, clientWidth / clientHeight / %g);
      camera.updateProjectionMatrix();
      camera.updateMatrixWorld();
      const now = [clientWidth, ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements];
      scene.traverse(o => {
        now.push(...o.position.toArray(), ...o.quaternion.toArray(), ...o.scale.toArray());
        if (o.material?.opacity < 1) Object.assign(o, { renderOrder: 1 }).material.depthWrite = false;  // hides nothing
      });
      if (last !== (last = now.join())) changed = performance.now();
      if (performance.now() > changed + 1000) return;  // colours and texts come a little later
      draw.forEach(d => d(scene, camera));
      place.framesDrawn += 1;
    };
    draws[1].render = draws[2].render = () => {};
  };
  calm(200);
})()"""


LEGEND = (
    "Axes of each body: red x or I, green y or O, blue z or S. E, N, U, the pole and gravity are fixed. Not to scale."
)


class MovingPicture:
    """A scene with a slider for the time; ``groups``: body -> what turns with it.

    Axes of the scene: east, north, up.  Nothing is to scale, and all bodies stand in one place.
    """

    def __init__(self, record: Record, bodies: list[MovingBody]) -> None:
        self.record, self.bodies = record, bodies
        self.time = np.asarray(record.channels["time"], dtype=float)
        found = attitudes(bodies, record, np.arange(1))
        self.names = [b.name for b in bodies if b.name in found]
        self.groups: dict[str, Any] = {}
        self.row = 0
        if not self.names:
            return
        with ui.element("div").classes("bar"):
            self.button = ui.button(icon="play_arrow", on_click=self._play).props("flat round").props(spoken("Play"))
            last = max(1, len(self.time) - 1)
            self.slider = ui.slider(min=0, max=last, value=0, step=1).classes("time")
            self.slider.props(spoken("time"))
            self.label = ui.label().classes("soft")
        self.scene = ui.scene(width=900, height=520, grid=False)
        self.scene.classes("scene").props("role=img").props(spoken("Moving picture"))
        with self.scene:
            self._ground(record.run.parameters)
            for depth, name in enumerate(self.names):
                self.groups[name] = self._body(depth, name)
        self.scene.move_camera(x=1.8, y=-2.25, z=1.35, look_at_z=0.2, duration=0.0)
        ui.label(say(LEGEND)).classes("soft")
        self.slider.on_value_change(lambda e: self.show(int(e.value)))
        self.timer = ui.timer(TICK, self._step, active=False)
        self.seen = PageSeen()
        ui.run_javascript(CALM % (self.scene.id, BREADTH))
        self.show(0)

    def attitudes(self, row: int) -> Mapping[str, Array]:
        """Return the axes of the bodies at a row of the channels."""
        return {n: a[0] for n, a in attitudes(self.bodies, self.record, np.array([row])).items()}

    def show(self, row: int) -> None:
        """Turn the bodies as they are at a row of the channels."""
        self.row = row
        turns = [[self.groups[n].id, a.tolist()] for n, a in self.attitudes(row).items() if n in self.groups]
        self.label.set_text(f"t = {self.time[row]:,.6g} s")
        ui.run_javascript(TURN % (json.dumps(turns), self.scene.id))

    def _play(self) -> None:
        self.timer.active = not self.timer.active
        self.button.props(f"icon={'pause' if self.timer.active else 'play_arrow'}")

    def _step(self) -> None:
        if not self.seen.now:
            return
        last = len(self.time) - 1
        following = self.row + max(1, last // FRAMES)
        self.slider.set_value(0 if self.row >= last else min(last, following))

    def _ground(self, parameters: Mapping[str, Any]) -> None:
        """Add east, north, up, the pole of the sky where the latitude is known, and gravity."""
        scene = self.scene
        for end, name in (([2.0, 0, 0], "E"), ([0, 2.0, 0], "N"), ([0, 0, 1.9], "U")):
            scene.line([0, 0, 0], end).material("#8a939c")
            scene.text(name, NAMED).move(*[1.05 * x for x in end])
        latitude = parameters.get("site.latitude", parameters.get("motion.latitude"))
        if isinstance(latitude, int | float):
            end = (1.9 * pole(float(latitude))).tolist()
            scene.line([0, 0, 0], end).material("#c09000")
            scene.text(say("pole"), f"{NAMED}; color: var(--warn)").move(*[1.12 * x for x in end])
        scene.line([0, 0, 0], [0, 0, -1.5]).material("#777777")
        scene.text("g", NAMED).move(0, 0, -1.6)

    def _body(self, depth: int, name: str) -> Any:
        """Add a body: a plate or a ring, with its three axes; return the group that turns."""
        size = SIZE * 0.8**depth
        with self.scene.group() as group:
            shade = SHADES[depth % len(SHADES)]
            if depth == len(self.names) - 1:
                self.scene.box(0.5 * size, 0.32 * size, 0.24 * size).material(shade)
            elif depth == 0:  # a plate in its x-y plane
                self.scene.cylinder(0.4 * size, 0.4 * size, 0.04 * size, 48).rotate(np.pi / 2, 0, 0).material(
                    shade, 0.5
                )
            else:
                self.scene.ring(0.36 * size, 0.42 * size, 48).material(shade, side="both")
            length = 0.62 * size
            for k, colour in enumerate(AXES):
                middle, tip = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
                middle[k], tip[k] = 0.5 * length, length
                self.scene.cylinder(THICK, THICK, length, 8).rotate(*ALONG[k]).move(*middle).material(colour)
                self.scene.cylinder(0.0, 3.0 * THICK, 8.0 * THICK, 12).rotate(*ALONG[k]).move(*tip).material(colour)
            place = [0.0, 0.0, 0.0]
            place[depth % 3] = 1.16 * length if depth < 3 else -length  # where no other body has its name
            named = say("body: " + name).removeprefix("body: ")
            self.scene.text(named, NAMED).move(*place)
        return group.with_name(f"body {name}")
