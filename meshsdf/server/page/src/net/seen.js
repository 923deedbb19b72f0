/** Which bricks this page holds, so that after a break only newer ones need to come. */

export class Seen {
  run = ""; // of the server that numbered the versions
  since = 0; // everything up to this version is here
  #newest = 0;

  /** @returns {{run?: string, since?: number}} what HELLO says of it */
  greeting() {
    return this.run ? { run: this.run, since: this.since } : {};
  }

  /** @param {string} run of the server that sends now; another one counts anew */
  begin(run) {
    if (run !== this.run) this.since = this.#newest = 0;
    this.run = run;
  }

  /**
   * @param {readonly {version: number}[]} bricks
   * @param {boolean} isComplete whether nothing is missing any more
   */
  add(bricks, isComplete) {
    for (const { version } of bricks) this.#newest = Math.max(this.#newest, version);
    if (isComplete) this.since = this.#newest;
  }
}
