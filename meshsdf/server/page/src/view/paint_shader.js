/**
 * The painted surface as the graphics card draws it, moved by its heights and lit.
 *
 * What is not there or not wanted is left out of the program: SHOW is the number of a display, LIT,
 * RELIEF, BRICKS, HEIGHTS and NORMALS are 0 or 1, the last two whether something is painted there.
 */

import { COLORS_GLSL, DETAIL_GLSL, FIND_GLSL, HEIGHTS_GLSL, NORMALS_GLSL } from "./lookup_shader.js";
import { RAMP_GLSL } from "./ramp.js";

/** Displays by their numbers. */
export const SHOWS = ["color", "normal", "displacement"];

export const PAINT_VERTEX = /* glsl */ `
precision highp float;
precision highp int;
#if RELIEF && HEIGHTS
${FIND_GLSL}
${HEIGHTS_GLSL}
uniform int moveLevel; // whose texels are about as far apart as the vertices
#endif
in vec3 position;
in vec3 normal;
in vec3 away; // the same for all vertices at a place, so that nothing tears where they move
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
out vec3 place; // before it was moved: that is where the texture knows it
out vec3 seen;
centroid out vec3 smoothNormal; // not beyond the triangle, where the rim would glitter
centroid out vec3 viewNormal;

void main() {
  vec3 moved = position;
#if RELIEF && HEIGHTS
  moved += away * (heightAt(position * perTexel, away, moveLevel) / perTexel);
#endif
  vec4 view = modelViewMatrix * vec4(moved, 1.0);
  place = position;
  seen = view.xyz;
  smoothNormal = normal;
  viewNormal = mat3(modelViewMatrix) * normal;
  gl_Position = projectionMatrix * view;
}
`;

export const PAINT_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
${FIND_GLSL}
${DETAIL_GLSL}
${COLORS_GLSL}
BETWEEN(colorBetween, colorAt)
#if HEIGHTS && (RELIEF || SHOW == 2)
${HEIGHTS_GLSL}
BETWEEN(heightBetween, slopeAndHeight)
#endif
#if NORMALS && RELIEF
${NORMALS_GLSL}
BETWEEN(normalBetween, normalAt)
#endif
${RAMP_GLSL}
in vec3 place;
in vec3 seen;
centroid in vec3 smoothNormal;
centroid in vec3 viewNormal;
uniform mat4 modelViewMatrix;
uniform float reach; // largest height
uniform vec3 bare;
uniform int nCursors;
uniform vec3 cursors[CURSORS];
uniform vec3 cursorNormals[CURSORS];
uniform vec2 rings; // radii: all of the brush, and where it is full
out vec4 pixel;

// The studio of the program's own pictures: directions are right, up, back of the camera
const vec3 KEY = normalize(vec3(-0.52, 0.62, 0.59));
const vec3 FILL = normalize(vec3(0.80, 0.10, 0.59));
const vec3 RIM = normalize(vec3(0.45, 0.50, -0.74));

// Bright light is bent below 1, so that white paint keeps its shape
vec3 bent(vec3 c) {
  vec3 over = max(c - 0.7, 0.0);
  return min(c, 0.7) + 0.3 * over / (0.3 + over);
}

vec3 lit(vec3 albedo, vec3 n) {
  vec3 eye = normalize(-seen);
  float wrapped = max((dot(n, KEY) + 0.3) / 1.3, 0.0);
  vec3 light = mix(vec3(0.16, 0.15, 0.15), vec3(0.38, 0.41, 0.45), 0.5 + 0.5 * n.y);
  light += vec3(0.66, 0.63, 0.60) * wrapped * wrapped;
  light += vec3(0.13, 0.145, 0.165) * max(dot(n, FILL), 0.0);
  float edge = gl_FrontFacing ? pow(1.0 - max(dot(n, eye), 0.0), 3.0) : 0.0;
  light += vec3(0.20, 0.22, 0.25) * edge * max(dot(n, RIM) + 0.4, 0.0);
  float gloss = pow(max(dot(n, normalize(KEY + eye)), 0.0), 32.0);
  return bent(albedo * light * 1.05 + 0.035 * gloss);
}

vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}

float line(float away, float slope) {
  return 1.0 - smoothstep(0.6, 1.5, abs(away) / slope);
}

// Where the brush's ball meets the surface: a light line with a dark one around it
vec3 withRings(vec3 color, vec3 facing) {
  vec3 dx = dFdx(place);
  vec3 dy = dFdy(place);
  for (int n = 0; n < nCursors; n++) {
    vec3 away = place - cursors[n];
    float d = length(away);
    if (dot(facing, cursorNormals[n]) < -0.1 || d > 1.5 * rings.x) continue;
    vec3 out_ = away / max(d, 1e-30);
    float slope = max(length(vec2(dot(out_, dx), dot(out_, dy))), 1e-30);
    float strength = n == 0 ? 0.95 : 0.45;
    color = mix(color, vec3(0.02), 0.6 * strength * line(d - rings.x - 1.4 * slope, slope));
    color = mix(color, vec3(1.0), 0.35 * strength * line(d - rings.y, slope));
    color = mix(color, vec3(1.0), strength * line(d - rings.x, slope));
  }
  return color;
}

// From orange, the finest, through green to blue and violet
vec3 levelColor(int level) {
  float hue = 0.07 + 0.105 * float(level);
  vec3 pure = clamp(abs(fract(hue + vec3(0.0, 0.6667, 0.3333)) * 6.0 - 3.0) - 1.0, 0.0, 1.0);
  return mix(vec3(1.0), pure, 0.72);
}

// The faces of the stored bricks, where they cut the surface, coloured by level
vec3 withBricks(vec3 color, vec3 facing) {
  vec3 texels = place * perTexel;
  vec3 slope = abs(dFdx(texels)) + abs(dFdy(texels));
  vec3 local;
  uvec2 state;
  int level = 0;
  if (!findBrick(baseStates, texels, facing, level, local, state)) return color;
  slope *= scaleOf(-level);
  vec3 away = min(local, 8.0 - local);
  // A face that the surface runs along would be a stain, not a line
  vec3 crossing = smoothstep(0.08, 0.25, slope / max(max(slope.x, slope.y), slope.z));
  vec3 lines = crossing * (1.0 - smoothstep(0.4, 1.3, away / max(slope, vec3(1e-30))));
  vec3 tint = levelColor(level);
  // Lines that lie too close together to be told apart give way to the tint
  float strength = 0.85 * smoothstep(3.0, 14.0, 8.0 / max(max(slope.x, slope.y), slope.z));
  return mix(mix(color, tint, 0.22), tint, strength * max(max(lines.x, lines.y), lines.z));
}

void main() {
  // Which way the face looks by its winding, whichever side is seen
  vec3 facing = normalize(cross(dFdx(place), dFdy(place)));
  if (!gl_FrontFacing) facing = -facing;
  vec3 texels = place * perTexel;
  float detail = detailOf(texels);
  vec3 own = normalize(smoothNormal);
  vec3 n = normalize(viewNormal);
  vec4 raised = vec4(0.0);
  vec4 painted = vec4(0.0);
#if HEIGHTS && (RELIEF || SHOW == 2)
  raised = heightBetween(texels, facing, detail);
#endif
#if NORMALS && RELIEF
  painted = normalBetween(texels, facing, detail);
#endif
#if RELIEF && (HEIGHTS || NORMALS)
  if (painted.a > 0.0 || raised.xyz != vec3(0.0)) {
    own = normalize((1.0 - painted.a) * own + painted.xyz);
    own = normalize(own - raised.xyz);
    n = normalize(mat3(modelViewMatrix) * own);
  }
#endif
  // From behind it is lit as if it looked here; slivers at the rim of a bump are not from behind
  if (!gl_FrontFacing && dot(n, normalize(seen)) > 0.1) n = -n;
#if SHOW == 1
  vec3 color = 0.5 + 0.5 * own;
#elif SHOW == 2
  vec3 color = rampColor(raised.w, reach);
#if LIT
  color = encoded(lit(linearOf(color), n));
#endif
#else
  vec4 paint = colorBetween(texels, facing, detail);
  vec3 color = paint.rgb + (1.0 - paint.a) * bare;
#if LIT
  color = lit(color, n);
#endif
  color = encoded(color);
#endif
#if BRICKS
  color = withBricks(color, facing);
#endif
  pixel = vec4(withRings(color, facing), 1.0);
}
`;
