/** Fewer pixels while the camera moves, if the machine is slow, and all when it stands. */

const SLOW = 45; // milliseconds between frames from which on they are drawn coarser in motion
const COARSER = 0.5; // of the pixels along a side
const PATIENCE = 2; // slow frames in a row that are no reason yet

export class Pace {
  #isCoarse = false;
  #slowFrames = 0; // in a row

  /** Of the pixels along a side. */
  get share() {
    return this.#isCoarse ? COARSER : 1;
  }

  /**
   * @param {number} elapsed milliseconds since the last frame of a motion; 0 if it is over
   * @returns {boolean} whether there is another share now
   */
  step(elapsed) {
    this.#slowFrames = elapsed > SLOW ? this.#slowFrames + 1 : 0;
    const isWanted = elapsed > 0 && (this.#isCoarse || this.#slowFrames > PATIENCE);
    const isOther = isWanted !== this.#isCoarse;
    this.#isCoarse = isWanted;
    return isOther;
  }
}
