// The WebSocket: commands out, answers and frames in. It is opened again when it breaks.

/** @typedef {{seq: number, refused?: string, text?: string}} Answer */

export class Link {
  /**
   * @param {(kind: string, value: any) => void} onState takes states in words
   * @param {(frame: ArrayBuffer) => string} onFrame takes arrays, and says their kind
   * @param {(up: boolean) => void} onUp hears whether the server is there
   */
  constructor(onState, onFrame, onUp) {
    this.onState = onState;
    this.onFrame = onFrame;
    this.onUp = onUp;
    this.seq = 0;
    /** @type {Map<number, (answer: Answer) => void>} */
    this.waiting = new Map();
    this.delay = 250;
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/socket`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.delay = 250;
      this.onUp(true);
    };
    socket.onmessage = (event) => this.take(event.data);
    socket.onclose = () => {
      for (const done of this.waiting.values()) done({ seq: 0, refused: "the connection broke" });
      this.waiting.clear();
      this.onUp(false);
      setTimeout(() => this.open(), this.delay);
      this.delay = Math.min(4000, this.delay * 2);
    };
    this.socket = socket;
  }

  /** @param {string | ArrayBuffer} data */
  take(data) {
    if (typeof data !== "string") {
      this.ack(this.onFrame(data));
      return;
    }
    const message = JSON.parse(data);
    if (message.kind !== undefined) {
      this.onState(message.kind, message.value);
      this.ack(message.kind);
      return;
    }
    const done = this.waiting.get(message.seq);
    this.waiting.delete(message.seq);
    if (done) done(message);
  }

  /** @param {string} kind */
  ack(kind) {
    this.send({ op: "ack", kind });
  }

  /** @param {object} command */
  send(command) {
    this.seq += 1;
    if (this.socket.readyState === WebSocket.OPEN) {
      this.socket.send(JSON.stringify({ seq: this.seq, command }));
      return this.seq;
    }
    return 0;
  }

  /**
   * Sends a command and waits for its answer.
   * @param {object} command
   * @returns {Promise<Answer>}
   */
  ask(command) {
    return new Promise((resolve) => {
      const seq = this.send(command);
      if (seq === 0) resolve({ seq, refused: "the studio is not running" });
      else this.waiting.set(seq, resolve);
    });
  }
}
