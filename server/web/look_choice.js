// Which look there is: the one that somebody chose, or the dataset's first; its legend; and what is said of it.
import * as panel from "./dataset_panel.js";
import { hide_legend, legend_of, legend_of_tint, show_legend } from "./legend.js";
import { begin_with } from "./link_state.js";
import { kPictures, looks_without } from "./looks.js";
import { tint_stops } from "./terrain_style.js";

export class LookChoice {
  // page: what is shown. coming: how many looks are on their way.
  constructor(page) {
    Object.assign(this, { page, problem: "", chosen: 0, coming: 0 });
  }

  // on: the page, or a tileset that is still to be shown, with its looks.
  async apply(on = this.page) {
    const turn = ++this.chosen;  // what an earlier choice is answered late is nobody's wish any more
    const choice = panel.look();
    panel.fill_ramps(kPictures[choice.look] ?? [], choice.ramp);
    choice.ramp = panel.look().ramp;
    // Provisional tiles go while they are looked at, and pictures of them would stay.
    if (on.looks.manifest.provisional && choice.look in kPictures) choice.look = "height";
    hide_legend();
    panel.take_back(this.problem);
    this.problem = "";
    const say_of_look = (words) => {
      if (turn !== this.chosen) return;
      if (words) panel.say(words, "problem");
      else panel.take_back(this.problem);
      this.problem = words;
    };
    ++this.coming;
    try {
      const about = await on.looks.show(choice.look, choice, say_of_look);
      if (turn === this.chosen && about?.ramp) show_legend(legend_of(choice.look, about));
    } catch (error) {
      // A folder of finished tiles has pictures only if it was built with them; nobody asked for the first look.
      const expected = error.type === "urn:cordillera:problem:not-in-folder" && choice.look === "relief";
      if (!expected) say_of_look(String(error.message || error));
    } finally {
      --this.coming;
    }
    if (turn === this.chosen && on.looks.look === "height") show_legend(legend_of_tint(tint_stops(...on.looks.manifest.bounds.slice(4))));
    this.page.scene.requestRender();
  }

  // The look that a dataset has at first: pictures that it names, else its relief, or its heights where it can have no picture.
  // texture: a photo that is on the tiles themselves.
  begin({ bounds, options }, texture) {
    const without = looks_without(bounds), look = options?.imagery ? "imagery" : texture ? "plain" : "relief", first = without.includes(look) ? "height" : look;
    begin_with("imagery", options?.imagery || "");
    begin_with("look", first);
    panel.leave_out_looks(without, first);
    panel.show_values();
  }

  // What the slider of errors has, until somebody moves it.
  begin_detail(looks) {
    begin_with("detail", looks.first_detail(panel.look().look));
    panel.show_values();
  }
}
