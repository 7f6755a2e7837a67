// Tool 1: looking. The left button moves the image.

export class Look {
  /** @param {any} app */
  constructor(app) {
    this.app = app;
  }

  down(view, event) {
    this.from = [event.offsetX, event.offsetY];
  }

  move(view, event) {
    if (!this.from) return;
    view.pan(event.offsetX - this.from[0], event.offsetY - this.from[1]);
    this.from = [event.offsetX, event.offsetY];
  }

  up() {
    this.from = null;
  }
}
