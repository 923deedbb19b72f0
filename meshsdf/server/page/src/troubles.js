/** What can go wrong for good, and what the painter can do about it. */

export const NO_WEBGL = {
  what: "this browser cannot draw the model: WebGL 2 is missing or turned off",
  fix: "turn on hardware acceleration in its settings, or open the address in a current Chrome, Edge, Firefox or Safari",
};

export const CARD_LOST = {
  what: "the graphics card stopped drawing",
  fix: "reload the page; nothing that was painted is lost",
};

export const NO_KEY = {
  what: "this page's key is not valid",
  fix: "open the address that `meshsdf paint` printed",
};

export const ELSEWHERE = {
  what: "this page was opened once more, and paints there now",
  fix: "reload the page to paint here",
};

export const REFUSED = {
  what: "the server refuses what this page sends",
  fix: "reload the page; what was not saved is kept until then",
};

export const OTHER_PROJECT = {
  what: "another project is served here now",
  fix: "reload the page to paint on it; what was not saved belongs to the first one",
};
