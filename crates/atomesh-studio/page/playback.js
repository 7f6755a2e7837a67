// The recorded iterations: played back, since a run takes milliseconds.

import { readPlayback } from "./frames.js";

const APART = 40; // milliseconds from frame to frame

export class Playback {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
    this.head = /** @type {HTMLInputElement} */ (document.getElementById("head"));
    this.button = /** @type {HTMLButtonElement} */ (document.getElementById("play"));
    this.text = document.getElementById("iteration");
    this.canvas = /** @type {HTMLCanvasElement} */ (document.getElementById("energy"));
    this.revision = -1;
    this.button.onclick = () => this.toggle();
    this.head.oninput = async () => {
      await this.fetch();
      this.show(Number(this.head.value));
    };
  }

  /** Hears how many frames there are. */
  update(count, revision) {
    this.head.max = String(Math.max(0, count - 1));
    this.head.disabled = this.button.disabled = count === 0 || this.app.dimension !== 2;
    if (revision !== this.revision && !this.isPlaying) this.stop();
  }

  async fetch() {
    if (this.revision === this.app.revision && this.record) return;
    const answer = await fetch("/view/playback");
    this.record = answer.status === 200 ? readPlayback(await answer.arrayBuffer()) : null;
    this.revision = this.app.revision;
    this.drawEnergy(-1);
  }

  async toggle() {
    if (this.isPlaying) {
      this.stop();
      return;
    }
    if (this.button.disabled) return;
    await this.fetch();
    if (!this.record) return;
    this.isPlaying = true;
    this.button.textContent = "Stop";
    for (let i = 0; i < this.record.count && this.isPlaying; i++) {
      this.show(i);
      await new Promise((resolve) => setTimeout(resolve, APART));
    }
    this.stop();
  }

  stop() {
    this.isPlaying = false;
    this.button.textContent = "Play";
    this.app.played = null;
    this.text.textContent = "";
    this.app.redraw();
  }

  show(i) {
    const { record } = this;
    if (!record) return;
    const colors = new Uint8Array(4 * record.atoms);
    for (let k = 0; k < record.atoms; k++) colors.set([255, 214, 90, 255], 4 * k);
    this.app.played = { places: record.frame(i), colors };
    this.head.value = String(i);
    const energy = record.energies[2 * i] + record.energies[2 * i + 1];
    this.text.textContent = `${i * record.stride + 1}: ${energy.toFixed(1)}`;
    this.drawEnergy(i);
    this.app.redraw();
  }

  drawEnergy(at) {
    const context = this.canvas.getContext("2d");
    const { width, height } = this.canvas;
    context.clearRect(0, 0, width, height);
    if (!this.record || this.record.count < 2) return;
    const energies = Array.from({ length: this.record.count }, (_, i) => this.record.energies[2 * i] + this.record.energies[2 * i + 1]);
    const least = Math.min(...energies);
    const extent = Math.max(...energies) - least || 1;
    const x = (i) => (i / (energies.length - 1)) * (width - 2) + 1;
    context.strokeStyle = "#6cb2ff";
    context.beginPath();
    energies.forEach((e, i) => context.lineTo(x(i), height - 2 - ((e - least) / extent) * (height - 4)));
    context.stroke();
    if (at >= 0) {
      context.fillStyle = "#ffd65a";
      context.fillRect(x(at) - 1, 0, 2, height);
    }
  }
}
