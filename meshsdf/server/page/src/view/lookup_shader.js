/**
 * Pictures of the texture are looked up by position alone.
 *
 * `findBrick` repeats that of octree.js: the page table of a level, the sheet that looks the way of
 * the face, the brick in the atlas, blended by the card; where nothing is stored, the level above.
 * A pixel that covers more than a texel lies between two levels (Williams 1983, "Pyramidal
 * parametrics", doi:10.1145/800059.801126).
 */

/** Finding bricks: needs SHIFT, LEVELS and the uniforms of `Painting`. */
export const FIND_GLSL = /* glsl */ `
uniform highp isampler2D pages;
uniform highp isampler2D groups;
uniform highp isampler2D sheets;
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

float scaleOf(int level) {
  return intBitsToFloat((127 + level) << 23); // 2^level, exactly
}

// The finest brick with something to show in a picture, from a level on; texels: the place in
// finest nodes
bool findBrick(
  highp usampler2D states, vec3 texels, vec3 facing, inout int level, out vec3 local, out uvec2 state
) {
  for (; level < LEVELS; level++) {
    vec3 nodes = texels * scaleOf(-level);
    ivec3 brick = ivec3(floor(nodes * 0.125));
    int entry = findEntry(level, brick, facing);
    if (entry < 0) continue;
    state = texelFetch(states, cellOf(entry), 0).rg;
    local = nodes - 8.0 * vec3(brick);
    if (state.x != 0u) return true;
  }
  return false;
}

bool isUniform(uvec2 state) {
  return state.x != 0x80000000u;
}

// To the 8192nd part of a texel, which is exact wherever in the atlas the brick is
vec4 inAtlas(highp sampler3D atlas, uvec2 state, vec3 local) {
  uvec3 slot = uvec3(state.y, state.y >> 10u, state.y >> 20u) & 1023u;
  local = floor(local * 8192.0 + 0.5) / 8192.0;
  return textureLod(atlas, (vec3(slot) + local + 0.5) / vec3(textureSize(atlas, 0)), 0.0);
}
`;

/** Heights in finest texels, and how steep they are: after FIND_GLSL. */
export const HEIGHTS_GLSL = /* glsl */ `
uniform highp usampler2D heightStates;
uniform highp sampler3D heightAtlas;

float heightIn(uvec2 state, vec3 local) {
  vec2 found = isUniform(state)
    ? vec2(unpackHalf2x16(state.y).x, float(state.y >> 16u) / 65535.0)
    : inAtlas(heightAtlas, state, local).rg;
  return found.y > 0.0 ? found.x / found.y : 0.0;
}

float heightAt(vec3 texels, vec3 facing, int level) {
  vec3 local;
  uvec2 state;
  return findBrick(heightStates, texels, facing, level, local, state) ? heightIn(state, local) : 0.0;
}

// The height some nodes further along the surface; most often that lies in the same brick
float heightBeside(vec3 texels, vec3 facing, int level, vec3 local, uvec2 state, vec3 way) {
  vec3 beside = local + way;
  bool isInside = all(greaterThanEqual(beside, vec3(0.0))) && all(lessThanEqual(beside, vec3(8.0)));
  return isInside ? heightIn(state, beside) : heightAt(texels + way * scaleOf(level), facing, level);
}

// The gradient of the heights along a face, by differences over one stored texel, and the height;
// the level becomes that of the brick
vec4 slopeAndHeight(vec3 texels, vec3 facing, inout int level) {
  vec3 local;
  uvec2 state;
  if (!findBrick(heightStates, texels, facing, level, local, state)) return vec4(0.0);
  vec3 across = abs(facing.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
  vec3 u = normalize(cross(facing, across));
  vec3 v = cross(facing, u);
  float alongU = heightBeside(texels, facing, level, local, state, 0.5 * u)
    - heightBeside(texels, facing, level, local, state, -0.5 * u);
  float alongV = heightBeside(texels, facing, level, local, state, 0.5 * v)
    - heightBeside(texels, facing, level, local, state, -0.5 * v);
  return vec4((alongU * u + alongV * v) * scaleOf(-level), heightIn(state, local));
}
`;

/** Colours: after FIND_GLSL. */
export const COLORS_GLSL = /* glsl */ `
uniform highp usampler2D baseStates;
uniform highp sampler3D baseAtlas;

vec3 linearOf(vec3 c) {
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}

// Linear, premultiplied
vec4 colorAt(vec3 texels, vec3 facing, inout int level) {
  vec3 local;
  uvec2 state;
  if (!findBrick(baseStates, texels, facing, level, local, state)) return vec4(0.0);
  if (!isUniform(state)) return inAtlas(baseAtlas, state, local);
  vec4 bytes = vec4((uvec4(state.y) >> uvec4(0u, 8u, 16u, 24u)) & 255u) / 255.0;
  return vec4(linearOf(bytes.rgb), bytes.a);
}
`;

/** Normals: after FIND_GLSL. */
export const NORMALS_GLSL = /* glsl */ `
uniform highp usampler2D normalStates;
uniform highp sampler3D normalAtlas;

// Times coverage, coverage
vec4 normalAt(vec3 texels, vec3 facing, inout int level) {
  vec3 local;
  uvec2 state;
  if (!findBrick(normalStates, texels, facing, level, local, state)) return vec4(0.0);
  if (isUniform(state)) {
    ivec3 bytes = ivec3(uvec3(state.y) << uvec3(24u, 16u, 8u)) >> 24; // with their signs
    return vec4(vec3(bytes) / 127.0, float(state.y >> 24u) / 255.0);
  }
  vec4 found = inAtlas(normalAtlas, state, local);
  return vec4((255.0 * found.xyz - 128.0) / 127.0, found.a);
}
`;

/** Level of detail that a pixel calls for, and how one looks up between two levels. */
export const DETAIL_GLSL = /* glsl */ `
float detailOf(vec3 texels) {
  float width = max(length(dFdx(texels)), length(dFdy(texels)));
  return clamp(log2(max(width, 1.0)), 0.0, float(LEVELS - 1));
}

#define BETWEEN(name, look) vec4 name(vec3 texels, vec3 facing, float detail) { \\
  int level = int(detail); \\
  float share = detail - float(level); \\
  int found = level; \\
  vec4 fine = look(texels, facing, found); \\
  if (share == 0.0 || found > level) return fine; \\
  found = level + 1; \\
  return mix(fine, look(texels, facing, found), share); \\
}
`;
