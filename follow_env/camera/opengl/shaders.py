"""GLSL of `OpenGLRenderer`: the law of light of `raster_shade` and the textures of `textures`."""

from follow_env.camera.raster.shade import BOUNCE, DIRECT, SOFT

LOOKS_WIDTH = 1024
"""Columns of the table of faces' looks."""
FAINT = 0.5 / 255.0
"""Direct light below this casts no shadow: it would not show."""


def surface_shader(lamps: int, shadows: bool) -> str:
    """Return the fragment shader for a scene with so many lamps, at least one."""
    return (
        f"#version 330 core\n#define LAMPS {lamps}\n#define LOOKS_WIDTH {LOOKS_WIDTH}\n"
        f"#define FAINT {FAINT}\n#define SOFT {SOFT:.9f}\n#define BOUNCE {BOUNCE:.9f}\n#define DIRECT {DIRECT:.9f}\n"
        f"{_SHADOWS if shadows else _NO_SHADOWS}{_TEXTURES}{_SURFACE}"
    )


VERTEX = """#version 330 core
uniform mat4 projection;
in vec3 in_position, in_normal, in_anchor;
out vec3 point, normal, anchor;

void main() {
    gl_Position = projection * vec4(in_position, 1.0);
    point = in_position;
    normal = in_normal;
    anchor = in_anchor;
}
"""

CASTER_VERTEX = """#version 330 core
uniform mat4 projection;
in vec3 in_position;

void main() { gl_Position = projection * vec4(in_position, 1.0); }
"""

CASTER_FRAGMENT = """#version 330 core
void main() {}
"""

_NO_SHADOWS = """
float lit(int lamp, vec3 point) { return 1.0; }
"""

_SHADOWS = """
uniform sampler2DShadow shadow_map;  // one square a lamp, side by side
uniform mat4 shadow_projections[LAMPS];

// The share of a lamp's direct light that reaches a point: 3 x 3 look-ups soften the edge. A lamp looks down, and where
// its picture ends the shadow fades.
float lit(int lamp, vec3 point) {
    vec4 seen = shadow_projections[lamp] * vec4(point, 1.0);
    vec3 place = seen.xyz / seen.w;
    float inside = 8.0 * (1.0 - max(abs(place.x), abs(place.y)));
    if (seen.w <= 0.0 || inside <= 0.0) return 1.0;
    vec2 texel = 1.0 / vec2(textureSize(shadow_map, 0));
    place = 0.5 * place + 0.5;
    float open = 0.0;
    for (int i = 0; i < 9; i++) {
        vec2 aside = 2.0 * (vec2(i % 3, i / 3) - 1.0) * texel;
        open += texture(shadow_map, vec3((place.x + lamp) / LAMPS + aside.x, place.y + aside.y, place.z));
    }
    return mix(1.0, open / 9.0, min(inside, 1.0));
}
"""

_TEXTURES = """
float hash(int i, int j) {
    uint h = uint(i) * 0x9E3779B1u ^ uint(j) * 0x85EBCA77u;
    h = (h ^ h >> 15) * 0x2C1B3C6Du;
    return float(h >> 24) / 255.0;
}

int cell(float x) { return int(x + 4096.0) - 4096; }

float tiles(vec2 st, float sharp) {
    vec2 at = st / 0.45;
    int i = cell(at.x), j = cell(at.y);
    float body = 1.0 + 0.14 * (hash(i, j) - 0.5);
    bool joint = at.x - i < 0.02 || at.y - j < 0.02;
    return body + min(1.0, sharp * 0.02 * 0.45) * ((joint ? 0.72 : body) - body);
}

float wood(vec2 st, float sharp) {
    float wave = st.x / 0.9;
    wave = abs(wave - cell(wave) - 0.5);
    float grain = hash(cell(st.y / 0.012 + 3.0 * wave), 7);
    return 1.0 + min(1.0, sharp * 0.5 * 0.012) * 0.26 * (grain - 0.5);
}

float brick(vec2 st, float sharp) {
    float b = st.y / 0.075;
    int j = cell(b);
    float a = st.x / 0.25 + 0.5 * (j & 1);
    int i = cell(a);
    float body = 1.0 + 0.3 * (hash(i, j) - 0.5);
    bool joint = a - i < 0.04 || b - j < 0.13;
    return 1.0 + min(1.0, sharp * 0.13 * 0.075) * ((joint ? 1.5 : body) - 1.0);
}

float carpet(vec2 st, float sharp) {
    float tuft = hash(cell(st.x / 0.015), cell(st.y / 0.015));
    return 1.0 + min(1.0, sharp * 0.5 * 0.015) * 0.35 * (tuft - 0.5);
}

float spines(vec2 st, float sharp) {
    float spine = hash(cell(st.x / 0.035), 3);
    return 1.0 + min(1.0, sharp * 0.5 * 0.035) * 1.1 * (spine - 0.5);
}

float painted(int texture, vec2 st, float sharp) {
    switch (texture) {
        case 1: return tiles(st, sharp);
        case 2: return wood(st, sharp);
        case 3: return brick(st, sharp);
        case 4: return carpet(st, sharp);
        case 5: return spines(st, sharp);
        default: return 1.0;
    }
}

float dressed(int pattern, vec3 anchor) {
    ivec3 stripe = ivec3(anchor / 0.045 + 1024.0), check = ivec3(anchor / 0.07 + 1024.0);
    int odd = pattern == 1 ? stripe.z : check.x + check.y + check.z;
    return (odd & 1) == 1 ? 0.55 : 1.0;
}
"""

_SURFACE = """
uniform vec3 eye;
uniform float focal, far, ambient, id;
uniform vec4 lamps[LAMPS];
uniform sampler2D looks;
in vec3 point, normal, anchor;
layout(location = 0) out vec4 color;
layout(location = 1) out float depth;

void main() {
    vec4 look = texelFetch(looks, ivec2(gl_PrimitiveID % LOOKS_WIDTH, gl_PrimitiveID / LOOKS_WIDTH), 0);
    vec3 n = normalize(gl_FrontFacing ? normal : -normal);
    depth = 1.0 / gl_FragCoord.w;
    float light = ambient;
    for (int i = 0; i < LAMPS; i++) {
        vec3 offset = lamps[i].xyz - point;
        float q = inversesqrt(dot(offset, offset) + SOFT);
        float direct = DIRECT * max(dot(n, offset) * q, 0.0), strength = lamps[i].w * q * q;
        if (strength * direct > FAINT) direct *= lit(i, point + 0.02 * n);
        light += strength * (BOUNCE + direct);
    }
    int kind = int(look.a);
    if (kind > 0) {
        float height = anchor.z > 0.5 ? far : abs(dot(n, eye - point));
        light *= painted(kind, anchor.xy, focal / depth * min(height / depth, 1.0));
    } else if (kind < 0) {
        light *= dressed(-kind, anchor);
    }
    color = vec4(look.rgb * light, id);
}
"""
