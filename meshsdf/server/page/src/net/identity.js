/** Who this tab is for the server: an id that outlives reloads and that no other tab has. */

const TRIES = 10;
const PAUSE = 100; // milliseconds; a tab that reloads gives its lock up a moment later

/** @returns {string} 32 hexadecimal digits */
export function newClient() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

/** @returns {Storage | null} the tab's own storage, if the browser allows one */
export function tabStorage() {
  try {
    const key = "meshsdf.try";
    sessionStorage.setItem(key, "1");
    sessionStorage.removeItem(key);
    return sessionStorage;
  } catch {
    return null;
  }
}

/**
 * Hold an id for as long as the tab lives. A duplicated tab copies the storage of the first, and
 * two that number their messages as one would each take the other's for its own.
 *
 * @param {string} client
 * @returns {Promise<boolean>} false if another tab holds it
 */
export async function claim(client) {
  if (!globalThis.navigator?.locks) return true; // only told apart where the browser can
  for (let n = 0; n < TRIES; n++) {
    const isMine = await new Promise((resolve) => {
      void navigator.locks.request(`meshsdf.${client}`, { ifAvailable: true }, (lock) => {
        resolve(lock !== null);
        return lock ? new Promise(() => {}) : undefined;
      });
    });
    if (isMine) return true;
    await new Promise((resolve) => setTimeout(resolve, PAUSE));
  }
  return false;
}
