// Programs of the graphics card, and the little it takes to build them.

const HEAD = "#version 300 es\nprecision highp float;\n";
const SCENE = "uniform mat4 view; uniform vec3 eye; uniform vec3 sun; uniform vec3 haze; uniform float far;\n";
const FOG = "vec3 fog(vec3 c, vec3 p) { float d = length(p - eye) / far; return mix(c, haze, smoothstep(0.18, 0.95, d)); }\n";

// Leaves and wood are things of eight words in a texture, 256 a line.
const THINGS = `
uniform highp usampler2D things; uniform int first;
uvec4 half_of(int thing, int which) { return texelFetch(things, ivec2((thing & 255) * 2 + which, thing >> 8), 0); }
float byte_of(uint word, int place) { return float(int(word << (24 - 8 * place)) >> 24) / 127.0; }
`;

/** Corners that are drawn of a leaf: four triangles. */
export const BLADE_CORNERS = 12;
/** Of a piece of wood: two. */
export const STICK_CORNERS = 6;

const LEAF_VERTEX = HEAD + SCENE + THINGS + `
const vec2 CORNERS[6] = vec2[6](vec2(-1.0, 0.0), vec2(-0.45, 0.8), vec2(-0.45, -0.8), vec2(0.45, 0.72), vec2(0.45, -0.72), vec2(1.0, 0.0));
const int TRIANGLES[12] = int[12](0, 1, 2, 2, 1, 3, 2, 3, 4, 4, 3, 5);
uniform vec3 foot; uniform vec2 turn; uniform float grow;
out vec3 tint; out vec3 place;
vec3 turned(vec3 v) { return vec3(turn.x * v.x - turn.y * v.y, turn.y * v.x + turn.x * v.y, v.z); }
float hash(float n) { return fract(sin(n) * 43758.5453); }
void main() {
  int blade = first + gl_VertexID / 12;
  vec2 corner = CORNERS[TRIANGLES[gl_VertexID % 12]];
  uvec4 low = half_of(blade, 0), high = half_of(blade, 1);
  vec3 centre = uintBitsToFloat(low.xyz);
  vec3 normal = vec3(byte_of(low.w, 0), byte_of(low.w, 1), byte_of(low.w, 2)), along = vec3(byte_of(high.x, 0), byte_of(high.x, 1), byte_of(high.x, 2));
  float kind = float(low.w >> 24);
  vec2 size = vec2(high.y & 65535u, high.y >> 16) / 65535.0;
  vec3 n = normalize(turned(normal)), a = normalize(turned(along));
  a = normalize(a - n * dot(a, n));
  vec3 b = cross(n, a);
  vec2 half_size = size * 6.5535 * 0.5 * 1.19 * grow;
  place = turned(centre) + foot + a * corner.x * half_size.x + b * corner.y * half_size.y;
  vec3 to = normalize(eye - place);
  float lit = dot(n, sun) * sign(dot(n, to));
  float own = hash(dot(centre, vec3(12.9898, 78.233, 37.719)));
  vec3 leaf = mix(vec3(0.16, 0.36, 0.13), vec3(0.42, 0.58, 0.20), own);
  vec3 base = kind > 3.5 && kind < 4.5 ? mix(vec3(0.75, 0.16, 0.13), vec3(0.86, 0.42, 0.20), own) : kind > 6.5 ? mix(vec3(0.30, 0.42, 0.16), vec3(0.52, 0.60, 0.28), own) : kind > 1.5 ? vec3(0.42, 0.33, 0.25) : leaf;
  // Light through a leaf from behind is weaker and more yellow.
  vec3 light = lit > 0.0 ? vec3(1.05, 1.02, 0.92) * lit : vec3(0.55, 0.6, 0.2) * -lit;
  float sky = 0.42 + 0.22 * abs(n.z) + 0.05 * clamp(place.z, 0.0, 3.0);
  tint = base * (light * 0.85 + sky);
  gl_Position = view * vec4(place, 1.0);
}`;

const PLAIN_FRAGMENT = HEAD + SCENE + FOG + `
in vec3 tint; in vec3 place; out vec4 colour;
void main() { colour = vec4(fog(tint, place), 1.0); }`;

// A far tree is a few large leaves that lie ready as corners; its instances are the places where such a tree stands.
const FAR_VERTEX = HEAD + SCENE + `
layout(location=0) in vec3 corner; layout(location=1) in vec3 normal; layout(location=2) in vec3 foot; layout(location=3) in vec2 turn;
out vec3 tint; out vec3 place;
vec3 turned(vec3 v) { return vec3(turn.x * v.x - turn.y * v.y, turn.y * v.x + turn.x * v.y, v.z); }
void main() {
  place = turned(corner) + foot;
  vec3 n = turned(normal);
  float lit = dot(n, sun) * sign(dot(n, eye - place));
  vec3 light = lit > 0.0 ? vec3(1.05, 1.02, 0.92) * lit : vec3(0.55, 0.6, 0.2) * -lit;
  tint = vec3(0.29, 0.47, 0.165) * (light * 0.85 + 0.5 + 0.05 * clamp(corner.z, 0.0, 3.0));
  gl_Position = view * vec4(place, 1.0);
}`;

// A stick is a ribbon that faces the eye; how round it is is the shading's business.
const STICK_VERTEX = HEAD + SCENE + THINGS + `
const vec2 CORNERS[4] = vec2[4](vec2(-1.0, 0.0), vec2(1.0, 0.0), vec2(-1.0, 1.0), vec2(1.0, 1.0));
const int TRIANGLES[6] = int[6](0, 1, 2, 2, 1, 3);
uniform vec3 foot; uniform vec2 turn;
out vec3 base_tint; out vec3 place; out float across; flat out vec3 side; flat out vec3 front;
vec3 turned(vec3 v) { return vec3(turn.x * v.x - turn.y * v.y, turn.y * v.x + turn.x * v.y, v.z); }
void main() {
  int stick = first + gl_VertexID / 6;
  vec2 corner = CORNERS[TRIANGLES[gl_VertexID % 6]];
  uvec4 low = half_of(stick, 0), high = half_of(stick, 1);
  vec3 base = uintBitsToFloat(low.xyz), tip = uintBitsToFloat(uvec3(low.w, high.xy));
  float radius = uintBitsToFloat(high.z), kind = float(high.w & 255u);
  vec3 from = turned(base) + foot, to = turned(tip) + foot, axis = normalize(to - from);
  vec3 at = mix(from, to, corner.y);
  front = normalize(eye - at);
  side = normalize(cross(axis, front));
  front = cross(side, axis);
  // Never thinner than a picture shows.
  float wide = max(radius, 0.0006 * length(eye - at));
  place = at + side * corner.x * wide;
  across = corner.x;
  base_tint = kind > 5.5 ? vec3(0.62, 0.66, 0.68) : kind > 4.5 ? vec3(0.58, 0.50, 0.40) : vec3(0.40, 0.31, 0.24);
  gl_Position = view * vec4(place, 1.0);
}`;
const STICK_FRAGMENT = HEAD + SCENE + FOG + `
in vec3 base_tint; in vec3 place; in float across; flat in vec3 side; flat in vec3 front; out vec4 colour;
void main() {
  vec3 n = normalize(side * across + front * sqrt(max(1.0 - across * across, 0.0)));
  colour = vec4(fog(base_tint * (0.5 + 0.75 * max(dot(n, sun), 0.0) + 0.1 * n.z), place), 1.0);
}`;

const SOLID_VERTEX = HEAD + SCENE + `
layout(location=0) in vec3 corner; layout(location=1) in vec3 normal; layout(location=2) in vec3 paint;
uniform mat4 model; out vec3 tint; out vec3 place;
void main() {
  place = (model * vec4(corner, 1.0)).xyz;
  vec3 n = normalize(mat3(model) * normal);
  tint = paint * (0.46 + 0.62 * max(dot(n, sun), 0.0) + 0.14 * n.z);
  gl_Position = view * vec4(place, 1.0);
}`;

const GROUND_VERTEX = HEAD + SCENE + `
layout(location=0) in vec2 corner; uniform vec3 middle; out vec3 place;
void main() { place = vec3(middle.xy + corner * far, 0.0); gl_Position = view * vec4(place, 1.0); }`;

const GROUND_FRAGMENT = HEAD + SCENE + FOG + `
in vec3 place; out vec4 colour; uniform float spacing; uniform float rows; uniform float dim;
float hash(vec2 p) { return fract(sin(dot(p, vec2(12.9898, 78.233))) * 43758.5453); }
float noise(vec2 p) { vec2 i = floor(p), f = fract(p); f = f * f * (3.0 - 2.0 * f);
  return mix(mix(hash(i), hash(i + vec2(1, 0)), f.x), mix(hash(i + vec2(0, 1)), hash(i + vec2(1, 1)), f.x), f.y); }
void main() {
  float n = noise(place.xy * 1.7) * 0.55 + noise(place.xy * 7.0) * 0.3 + noise(place.xy * 23.0) * 0.15;
  vec3 grass = mix(vec3(0.33, 0.43, 0.22), vec3(0.47, 0.55, 0.30), n), soil = mix(vec3(0.43, 0.36, 0.28), vec3(0.55, 0.47, 0.37), n);
  float row = spacing > 0.0 ? clamp(floor(place.x / spacing + 0.5), 0.0, rows - 1.0) * spacing : 0.0;
  float bare = smoothstep(0.62, 0.42, abs(place.x - row) + 0.16 * (n - 0.5));
  vec3 c = mix(grass, soil, bare);
  // Where the wheels go.
  float alley = spacing > 0.0 ? abs(abs(fract(place.x / spacing) - 0.5) * spacing - 0.62) : 9.0;
  c = mix(c, soil * 0.95, 0.45 * smoothstep(0.22, 0.08, alley));
  // A line a metre, near by.
  vec2 w = fwidth(place.xy), g = abs(fract(place.xy - 0.5) - 0.5) / w;
  float line = (1.0 - min(min(g.x, g.y), 1.0)) * smoothstep(0.12, 0.02, max(w.x, w.y));
  c = mix(c, c * 0.82, line * 0.7) * dim;
  colour = vec4(fog(c, place), 1.0);
}`;

const SKY_VERTEX = HEAD + SCENE + `
layout(location=0) in vec2 corner; out float rise;
// Where the horizon is on the picture: the way that is level and straight ahead, infinitely far.
void main() { gl_Position = vec4(corner, 0.999, 1.0);
  vec4 level = view * vec4(normalize(vec3(-view[0].w - 1e-6, -view[1].w, 0.0)) * -1.0, 0.0);
  rise = corner.y - level.y / max(level.w, 1e-3); }`;
const SKY_FRAGMENT = HEAD + SCENE + `
in float rise; out vec4 colour; uniform vec3 top; void main() { colour = vec4(mix(haze, top, smoothstep(0.0, 1.1, rise)), 1.0); }`;

const SHEET_VERTEX = HEAD + SCENE + `
layout(location=0) in vec3 corner; out vec3 place; void main() { place = corner; gl_Position = view * vec4(corner, 1.0); }`;
const SHEET_FRAGMENT = HEAD + SCENE + `
in vec3 place; out vec4 colour; uniform vec4 paint; void main() { colour = paint; }`;

const POINT_VERTEX = HEAD + SCENE + `
layout(location=0) in vec3 corner; layout(location=1) in vec3 paint; uniform float dot_size; out vec3 tint; out vec3 place;
void main() { place = corner; tint = paint; gl_Position = view * vec4(corner, 1.0); gl_Position.z -= 0.0006 * gl_Position.w; gl_PointSize = clamp(dot_size / gl_Position.w, 1.5, 9.0); }`;

const PROGRAMS = {
  leaf: [LEAF_VERTEX, PLAIN_FRAGMENT],
  far: [FAR_VERTEX, PLAIN_FRAGMENT],
  stick: [STICK_VERTEX, STICK_FRAGMENT],
  solid: [SOLID_VERTEX, PLAIN_FRAGMENT],
  ground: [GROUND_VERTEX, GROUND_FRAGMENT],
  sky: [SKY_VERTEX, SKY_FRAGMENT],
  sheet: [SHEET_VERTEX, SHEET_FRAGMENT],
  point: [POINT_VERTEX, PLAIN_FRAGMENT],
};

function compile(gl, kind, source) {
  const shader = gl.createShader(kind);
  gl.shaderSource(shader, source);
  gl.compileShader(shader);
  if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(`shader: ${gl.getShaderInfoLog(shader)}`);
  return shader;
}

/** A program with its uniforms by name. */
function build(gl, [vertex, fragment]) {
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl, gl.VERTEX_SHADER, vertex));
  gl.attachShader(program, compile(gl, gl.FRAGMENT_SHADER, fragment));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`program: ${gl.getProgramInfoLog(program)}`);
  const at = {};
  for (let i = 0; i < gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(program, i);
    at[name] = gl.getUniformLocation(program, name);
  }
  return { program, at };
}

/** Every program, by name. */
export function programs(gl) {
  return Object.fromEntries(Object.entries(PROGRAMS).map(([name, sources]) => [name, build(gl, sources)]));
}
