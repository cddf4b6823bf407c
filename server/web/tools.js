// What the pointer is over, and what a click on the terrain is for, if it is for anything: one tool at a time.
import * as panel from "./dataset_panel.js";
import { go_to, kCloser, place_under } from "./globe.js";
import { write_link } from "./link_state.js";
import { Profile } from "./profile.js";
import { base_of } from "./service.js";
import { tell } from "./unseen.js";
import { Viewshed } from "./viewshed.js";

const Cesium = window.Cesium;

export class Tools {
  constructor(page, report) {
    Object.assign(this, { page, report, pointed: null });
  }

  // As soon as there is a scene.
  make() {
    const { page, report } = this, base = () => base_of(page.id);
    page.profile = new Profile(page.scene, {
      base, factor: () => page.scene.verticalExaggeration, on_error: report,
      on_change: (words) => { panel.press("measure", page.profile?.on); panel.say_of_tool(words); },
    });
    page.viewshed = new Viewshed({
      base, on_error: report,
      on_picture: (pictures) => { page.looks?.lay_over(pictures); page.scene.requestRender(); },
      on_change: (words) => { panel.press("look-around", page.viewshed?.on); panel.say_of_tool(words); write_link(); },
    });
    const { MOUSE_MOVE, LEFT_CLICK, LEFT_DOUBLE_CLICK } = Cesium.ScreenSpaceEventType, on = page.widget.screenSpaceEventHandler;
    on.setInputAction(({ endPosition }) => this.point_at(endPosition), MOUSE_MOVE);
    on.setInputAction(({ position }) => {
      this.point_at(position);  // a finger does not hover
      this.on()?.take(this.pointed);
    }, LEFT_CLICK);
    on.setInputAction(({ position }) => { if (!this.on()) go_to(page.widget, page.tileset, position, kCloser); }, LEFT_DOUBLE_CLICK);
    window.addEventListener("keydown", ({ key }) => { if (key === "Escape" && this.on() && !document.querySelector("dialog[open]")) this.stop(); });
  }

  on() {
    return [this.page.profile, this.page.viewshed].find((tool) => tool.on);
  }

  stop() {
    for (const tool of [this.page.profile, this.page.viewshed]) tool.stop();
  }

  toggle(tool) {
    const on = !tool.on;
    this.stop();
    if (on) tool.start();
  }

  // The height under the pointer, once more when the geoid's height there is known. aloud: it is read out, too.
  point_at(position, aloud = false) {
    const { widget, tileset } = this.page;
    this.pointed = tileset && place_under(widget, tileset, position);
    this.aloud = aloud;
    this.point_again();
  }

  point_again() {
    const words = panel.show_position(this.pointed, this.page.manifest, this.page.sea);
    if (this.aloud) tell(words || "There is no terrain in the middle of the window.");
  }

  // What a pointer and its click take, for those who have keys.
  take_middle() {
    const { widget: { canvas } } = this.page;
    this.point_at(new Cesium.Cartesian2(canvas.clientWidth / 2, canvas.clientHeight / 2), true);
    this.on()?.take(this.pointed);
  }
}
