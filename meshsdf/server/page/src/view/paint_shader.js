/**
 * The painted surface: colours are looked up by position alone.
 *
 * `shown` repeats `findBrick` of octree.js: the page table of a level, the sheet that looks the way
 * of the face, the brick in the atlas, blended by the card; where nothing is stored, the level above.
 * A pixel that covers more than a texel lies between two levels (Williams 1983, "Pyramidal
 * parametrics", doi:10.1145/800059.801126).
 */

export const PAINT_VERTEX = /* glsl */ `
precision highp float;
in vec3 position;
in vec3 normal;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
out vec3 place;
out vec3 seen;
centroid out vec3 smoothNormal; // not beyond the triangle, where the rim would glitter
centroid out vec3 viewNormal;

void main() {
  vec4 view = modelViewMatrix * vec4(position, 1.0);
  place = position;
  seen = view.xyz;
  smoothNormal = normal;
  viewNormal = mat3(modelViewMatrix) * normal;
  gl_Position = projectionMatrix * view;
}
`;

/**
 * Looking colours up: needs SHIFT, LEVELS and the uniforms of `lookupUniforms`.
 */
const LOOKUP = /* glsl */ `
uniform highp isampler2D pages;
uniform highp isampler2D groups;
uniform highp isampler2D sheets;
uniform highp usampler2D states;
uniform highp sampler3D atlas;
uniform ivec4 heads[LEVELS];
uniform float perTexel;

ivec2 cellOf(int number) {
  return ivec2(number & ((1 << SHIFT) - 1), number >> SHIFT);
}

int pageCell(int page, ivec3 cell) {
  cell &= 15;
  return texelFetch(pages, cellOf((page << 12) + (cell.x << 8) + (cell.y << 4) + cell.z), 0).r;
}

vec3 sheetNormal(int entry) {
  ivec2 code = texelFetch(sheets, cellOf(entry), 0).rg;
  if (code.x == -32768) return vec3(0.0);
  vec2 xy = vec2(code) / 32767.0;
  float z = 1.0 - abs(xy.x) - abs(xy.y);
  float fold = max(-z, 0.0);
  xy += vec2(xy.x >= 0.0 ? -fold : fold, xy.y >= 0.0 ? -fold : fold);
  return normalize(vec3(xy, z));
}

int findEntry(int level, ivec3 brick, vec3 facing) {
  ivec3 b = brick - heads[level].xyz;
  if (((b.x | b.y | b.z) & ~4095) != 0) return -1;
  int page = pageCell(heads[level].w, b >> 8);
  if (page < 0) return -1;
  page = pageCell(page, b >> 4);
  if (page < 0) return -1;
  int code = pageCell(page, b);
  if (code > -3) return code;
  ivec2 group = texelFetch(groups, cellOf(-3 - code), 0).rg;
  int best = -1;
  float most = -1e30;
  for (int entry = group.x; entry < group.x + group.y; entry++) {
    float along = dot(sheetNormal(entry), facing);
    if (along > most) {
      best = entry;
      most = along;
    }
  }
  return best;
}

vec3 linearOf(vec3 c) {
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}

// The finest brick with something to show, from a level on; texels: the place in finest nodes
bool findBrick(vec3 texels, vec3 facing, inout int level, out vec3 local, out uvec2 state) {
  for (; level < LEVELS; level++) {
    vec3 nodes = texels * intBitsToFloat((127 - level) << 23); // 2^-level, exactly
    ivec3 brick = ivec3(floor(nodes * 0.125));
    int entry = findEntry(level, brick, facing);
    if (entry < 0) continue;
    state = texelFetch(states, cellOf(entry), 0).rg;
    local = nodes - 8.0 * vec3(brick);
    if (state.x != 0u) return true;
  }
  return false;
}

// Linear, premultiplied
vec4 shown(vec3 texels, vec3 facing, inout int level) {
  vec3 local;
  uvec2 state;
  if (!findBrick(texels, facing, level, local, state)) return vec4(0.0);
  if (state.x == 0x80000000u) {
    uvec3 slot = uvec3(state.y, state.y >> 10u, state.y >> 20u) & 1023u;
    return textureLod(atlas, (vec3(slot) + local + 0.5) / vec3(textureSize(atlas, 0)), 0.0);
  }
  vec4 bytes = vec4((uvec4(state.y) >> uvec4(0u, 8u, 16u, 24u)) & 255u) / 255.0;
  return vec4(linearOf(bytes.rgb), bytes.a);
}

vec4 textureAt(vec3 point, vec3 facing) {
  vec3 texels = point * perTexel;
  float width = max(length(dFdx(texels)), length(dFdy(texels)));
  float detail = clamp(log2(max(width, 1.0)), 0.0, float(LEVELS - 1));
  int level = int(detail);
  float share = detail - float(level);
  int found = level;
  vec4 fine = shown(texels, facing, found);
  if (share == 0.0 || found > level) return fine;
  found = level + 1;
  return mix(fine, shown(texels, facing, found), share);
}
`;

export const PAINT_FRAGMENT = /* glsl */ `
precision highp float;
precision highp int;
${LOOKUP}
in vec3 place;
in vec3 seen;
centroid in vec3 smoothNormal;
centroid in vec3 viewNormal;
uniform int show; // 0 colour in light, 1 colour alone, 2 normals
uniform vec3 bare;
uniform bool wireframe;
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
  if (!findBrick(texels, facing, level, local, state)) return color;
  slope *= intBitsToFloat((127 - level) << 23);
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
  vec3 color;
  if (show == 2) {
    color = 0.5 + 0.5 * normalize(smoothNormal);
  } else {
    vec4 paint = textureAt(place, facing);
    vec3 albedo = paint.rgb + (1.0 - paint.a) * bare;
    vec3 n = normalize(viewNormal) * (gl_FrontFacing ? 1.0 : -1.0);
    color = encoded(show == 0 ? lit(albedo, n) : albedo);
  }
  if (wireframe) color = withBricks(color, facing);
  pixel = vec4(withRings(color, facing), 1.0);
}
`;
