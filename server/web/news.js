// What may happen to the dataset while it is shown: another version, its end, a service that does not answer for a while, a tile that is missing.
import * as panel from "./dataset_panel.js";
import { base_of, fetch_json } from "./service.js";

const kNews_ms = 10000, kSilence_ms = 2000;
const kGone = "This dataset is not there any more. What is still seen of it goes with this page.";
const kSilent = "The service does not answer. What is missing here comes as soon as it does.";
const kChanged = "This dataset has changed: this is its new version.";
const kAnswers = ["The service answers again.", 4000];

// Nobody answers, or a proxy does in the place of the service.
const is_silence = (status) => !status || status >= 502;

export class News {
  // page, wanted: what is shown, and what somebody chose. on.open(id, words), on.again(): the same dataset with all of its tiles asked for anew;
  // on.gone(), on.report(error).
  constructor(page, wanted, on) {
    Object.assign(this, { page, wanted, on, silence: null, missing: false, asked: null, anew: null, missed: new WeakMap() });
    window.setInterval(() => this.look(), kNews_ms);
    document.addEventListener("visibilitychange", () => this.look());
  }

  // A raster is replaced, or somebody gives the dataset another title: tiles and words of one version are shown, never of two. Or it is deleted.
  async look() {
    const { page, wanted } = this, { id, version } = wanted;
    if (document.visibilityState !== "visible" || !version || page.id !== id || page.manifest.provisional || this.silence) return;
    const now = await fetch_json(base_of(id)).catch(({ status }) => (status === 404 ? kGone : is_silence(status) ? kSilent : null));
    if (!now || wanted.id !== id || wanted.version !== version) return;
    if (now === kSilent) this.wait(() => this.look()).catch(this.on.report);
    else if (now === kGone) this.tell_gone();
    else if (now.version !== version) await this.on.open(id, kChanged);
  }

  tell_gone() {
    this.wanted.version = undefined;  // it is not asked for again
    panel.say_state(kGone, true);
    this.on.gone();
  }

  // A tile that cannot be had. It is asked for once more, with all others: the service may have been away. Or the dataset is gone.
  async tell_of_tile(tileset, failed) {
    if (this.page.tileset !== tileset) return this.missed.set(tileset, failed);  // it is not shown yet
    if (!(await this.answers())) return this.wait();
    await this.look();
    if (this.page.tileset !== tileset || !this.wanted.version) return undefined;
    if (this.anew !== this.wanted.version) {
      this.anew = this.wanted.version;
      return this.on.again();
    }
    return this.on.report(new Error(`${failed.url}: ${failed.message}`));
  }

  // A picture that cannot be had. There are places without one, so only a service that does not answer is told.
  async tell_of_picture(tileset) {
    this.asked ??= this.answers().finally(() => setTimeout(() => { this.asked = null; }, kSilence_ms));  // for many pictures at once
    if (this.page.tileset === tileset && !(await this.asked)) await this.wait();
  }

  // It is shown from now on.
  shown(tileset) {
    const failed = this.missed.get(tileset);
    if (failed) this.tell_of_tile(tileset, failed).catch(this.on.report);
  }

  answers() {
    return fetch_json(this.wanted.id ? base_of(this.wanted.id) : "v1").then(() => true, ({ status }) => !is_silence(status));
  }

  // Until it answers. Then what could not be had is asked for again. then(): in the place of that, where nothing is known to be missing.
  wait(then = null) {
    this.missing ||= !then;
    return this.silence ??= this.wait_for_answer(then);
  }
  async wait_for_answer(then) {
    panel.say(kSilent, "problem");
    do await new Promise((over) => setTimeout(over, kSilence_ms)); while (!(await this.answers()));
    const again = this.missing ? this.on.again : then;
    Object.assign(this, { anew: null, silence: null, missing: false });  // it may fall silent again meanwhile
    this.page.error = null;
    panel.say_for(...kAnswers);
    await again();
  }
}
