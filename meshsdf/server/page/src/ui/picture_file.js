/** Pictures that are opened here, or by the server where the browser cannot read them. */

import { element } from "./element.js";

/**
 * @typedef {object} Picture
 * @property {string} name
 * @property {Blob} blob
 * @property {ImageBitmap} bitmap what is seen of it here
 * @property {string} url of the same
 * @property {string} id the server's; "" until it is sent
 * @property {boolean} isBlank whether the browser cannot show it
 */

/**
 * @param {File} file
 * @param {import("../actions.js").Session} session
 * @returns {Promise<Picture>}
 */
export async function openPicture(file, session) {
  const { name } = file;
  const url = URL.createObjectURL(file);
  try {
    const bitmap = await createImageBitmap(file);
    return { name, blob: file, bitmap, url, id: "", isBlank: false };
  } catch {
    URL.revokeObjectURL(url);
    const { id, width, height } = await session.upload(file);
    return { name, blob: file, id, isBlank: true, ...(await greyPicture(width, height)) };
  }
}

/** @param {number} width @param {number} height */
async function greyPicture(width, height) {
  const canvas = element("canvas", { width, height });
  const context = canvas.getContext("2d");
  if (context) {
    context.fillStyle = "#8a8a8a";
    context.fillRect(0, 0, width, height);
  }
  const blob = await new Promise((resolve) => canvas.toBlob(resolve));
  const url = URL.createObjectURL(/** @type {Blob} */ (blob));
  return { bitmap: await createImageBitmap(canvas), url };
}
