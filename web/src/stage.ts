// One WebGL context for all views: each is drawn into it and copied to a canvas of its own.
import type { Surface3 } from './glb';
import { t } from './i18n';
import type * as Three from './three';

// In a chunk of its own, which changes with its version only.
const T = await import('./three');

/** From where shapes are seen; views that share one turn together. */
export class Camera {
    turn = new T.Quaternion();
    zoom = 1;
    private listeners = new Set<() => void>();
    listen(listener: () => void): () => void {
        this.listeners.add(listener);
        return () => this.listeners.delete(listener);
    }
    changed(): void {
        for (const listener of [...this.listeners]) listener();
    }
    /** By angles about the axes of the screen. */
    rotate(x: number, y: number): void {
        const about = (ax: number, ay: number, angle: number) => new T.Quaternion().setFromAxisAngle(new T.Vector3(ax, ay, 0), angle);
        this.turn.premultiply(about(0, 1, y)).premultiply(about(1, 0, x)).normalize();
        this.changed();
    }
    scale(factor: number): void {
        this.zoom = Math.max(0.2, Math.min(20, this.zoom * factor));
        this.changed();
    }
    /** 1 to 6: from before, behind, left, right, above, below; 0: the first view. */
    side(n: number): void {
        const up = Math.PI / 2;
        const turns: [number, number][] = [[-1.2, 0.5], [-up, 0], [-up, Math.PI], [-up, up], [-up, -up], [0, 0], [Math.PI, 0]];
        const [x, y] = turns[n];
        this.turn.setFromAxisAngle(new T.Vector3(1, 0, 0), x);
        this.turn.premultiply(new T.Quaternion().setFromAxisAngle(new T.Vector3(0, 1, 0), y));
        if (n === 0) this.zoom = 1;
        this.changed();
    }
    /** The turn as a matrix, column by column. */
    matrix(): number[] {
        return new T.Matrix3().setFromMatrix4(new T.Matrix4().makeRotationFromQuaternion(this.turn)).toArray();
    }
    constructor() {
        this.side(0);
    }
    /** As an address has it: the turn, and how near. */
    get text(): string {
        const { x, y, z, w } = this.turn;
        return [x, y, z, w, this.zoom].map((v) => +v.toFixed(4)).join(',');
    }
    set text(text: string) {
        const [x, y, z, w, zoom] = text.split(',').map(Number);
        const turn = new T.Quaternion(x, y, z, w);
        if (!(turn.length() > 0.5 && turn.length() < 2 && zoom > 0) || text === this.text) return;
        this.turn.copy(turn.normalize());
        this.zoom = Math.max(0.2, Math.min(20, zoom));
        this.changed();
    }
}

export interface Part { shape: Surface3; colour?: string; colours?: Float32Array; opacity?: number }
export interface Look { background?: string | null; centre: [number, number, number]; radius: number; cut?: number | null; mark?: number[]; markTexts?: string[] }

let renderer: Three.WebGLRenderer | undefined;
/** This browser has no WebGL: asked once, as each try takes its time and leaves errors. */
let lacking = false;
const scene = new T.Scene();
const holder = new T.Group();
const camera = new T.OrthographicCamera();
const ambient = new T.AmbientLight(0xffffff, 1.2);
const light = new T.DirectionalLight(0xffffff, 2);
light.position.set(-0.4, 0.8, 1);
scene.add(holder, ambient, light);

function context(width: number, height: number): Three.WebGLRenderer | undefined {
    if (!renderer && !lacking) {
        lacking = !document.createElement('canvas').getContext('webgl2');
        if (lacking) return undefined;
        renderer = new T.WebGLRenderer({ antialias: true, alpha: true });
        renderer.setPixelRatio(1);
        renderer.localClippingEnabled = true;
        renderer.setSize(width, height, false);
    }
    if (!renderer) return undefined;
    const now = renderer.domElement;
    if (now.width < width || now.height < height) renderer.setSize(Math.max(width, now.width), Math.max(height, now.height), false);
    return renderer;
}

/** After a large picture: what follows is small again. */
export function shrink(): void {
    renderer?.setSize(1, 1, false);
}

/** Geometries of shapes that are shown; gone with them. */
const geometries = new WeakMap<Surface3, Three.BufferGeometry>();
function geometryOf(shape: Surface3): Three.BufferGeometry {
    let geometry = geometries.get(shape);
    if (!geometry) {
        geometry = new T.BufferGeometry();
        geometry.setAttribute('position', new T.BufferAttribute(shape.positions, 3));
        geometry.setAttribute('normal', new T.BufferAttribute(shape.normals, 3));
        geometry.setIndex(new T.BufferAttribute(shape.indices, 1));
        geometries.set(shape, geometry);
    }
    return geometry;
}

/** Positions or normals of a shape were changed in place. */
export function moved(shape: Surface3): void {
    const geometry = geometries.get(shape);
    if (!geometry) return;
    geometry.getAttribute('position').needsUpdate = true;
    geometry.getAttribute('normal').needsUpdate = true;
}

/** Gives back what the graphics processor holds of a shape. */
export function forget(shape: Surface3): void {
    geometries.get(shape)?.dispose();
    geometries.delete(shape);
}

/** Materials are kept: with the last of a kind its program would go, and be compiled again for the next picture. */
const materials = new Map<string, Three.MeshLambertMaterial>();
function materialOf(part: Part, cut: boolean): Three.MeshLambertMaterial {
    const opacity = part.opacity ?? 1;
    const colour = part.colours ? '#ffffff' : part.colour ?? '#c8b090';
    const key = `${!!part.colours} ${colour} ${opacity} ${cut}`;
    let material = materials.get(key);
    if (!material) {
        material = new T.MeshLambertMaterial({
            color: new T.Color(colour), vertexColors: !!part.colours, transparent: opacity < 1, opacity, depthWrite: opacity >= 1,
            side: T.DoubleSide,
        });
        materials.set(key, material);
    }
    return material;
}

/** In the place of the shape, and for those who hear the page. */
function sayLacking(to: HTMLCanvasElement): void {
    const text = t`No shapes: WebGL is off in this browser`;
    const pen = to.getContext('2d')!;
    pen.clearRect(0, 0, to.width, to.height);
    pen.fillStyle = getComputedStyle(to).color;
    pen.textAlign = 'center';
    pen.font = `${Math.max(10, Math.min(28, Math.round(to.width / 22)))}px sans-serif`;
    pen.fillText(text, to.width / 2, to.height / 2, to.width);
    to.setAttribute('aria-label', text);
}

/** Half the width and half the height of what a view shows. */
function frame(from: Camera, look: Look, aspect: number): [number, number] {
    const half = (look.radius * 1.05) / from.zoom;
    return [half * Math.max(1, aspect), half * Math.max(1, 1 / aspect)];
}

/** The vertex at a place of a view, both its coordinates from 0 to 1: of the foremost face there the nearest one. */
export function pick(shape: Surface3, from: Camera, look: Look, aspect: number, x: number, y: number): number | undefined {
    const [right, top] = frame(from, look, aspect);
    const px = (2 * x - 1) * right;
    const py = (1 - 2 * y) * top;
    const m = from.matrix();
    const { positions, indices } = shape;
    const seen = new Float32Array(positions.length);
    for (let i = 0; i < positions.length; i += 3) {
        const a = positions[i] - look.centre[0], b = positions[i + 1] - look.centre[1], c = positions[i + 2] - look.centre[2];
        for (let k = 0; k < 3; k++) seen[i + k] = m[k] * a + m[3 + k] * b + m[6 + k] * c;
    }
    const front = look.cut === null || look.cut === undefined ? Infinity : look.cut * look.radius;
    let best = -Infinity;
    let found: number | undefined;
    for (let f = 0; f < indices.length; f += 3) {
        const corners = [indices[f], indices[f + 1], indices[f + 2]];
        const [a, b, c] = corners.map((i) => 3 * i);
        const side = (i: number, j: number) => (seen[j] - seen[i]) * (py - seen[i + 1]) - (seen[j + 1] - seen[i + 1]) * (px - seen[i]);
        const [u, v, w] = [side(b, c), side(c, a), side(a, b)];
        const sum = u + v + w;
        if (!sum || Math.min(u / sum, v / sum, w / sum) < 0) continue;
        const z = (u * seen[a + 2] + v * seen[b + 2] + w * seen[c + 2]) / sum;
        if (z <= best || z > front) continue;
        best = z;
        found = corners[[u / sum, v / sum, w / sum].reduce((most, value, i, all) => (value > all[most] ? i : most), 0)];
    }
    return found;
}

/** The names of the marks, beside them. */
function writeMarks(pen: CanvasRenderingContext2D, from: Camera, look: Look, width: number, height: number): void {
    const [right, top] = frame(from, look, width / height);
    const m = from.matrix();
    const size = Math.max(11, Math.round(width / 32));
    pen.font = `bold ${size}px sans-serif`;
    pen.lineWidth = size / 4;
    pen.strokeStyle = '#ffffff';
    pen.fillStyle = '#1d2329';
    look.markTexts!.forEach((text, i) => {
        const [a, b, c] = [0, 1, 2].map((k) => look.mark![3 * i + k] - look.centre[k]);
        const x = ((m[0] * a + m[3] * b + m[6] * c) / right + 1) * (width / 2) + size / 2;
        const y = (1 - (m[1] * a + m[4] * b + m[7] * c) / top) * (height / 2) - size / 3;
        pen.strokeText(text, x, y);
        pen.fillText(text, x, y);
    });
}

export function draw(to: HTMLCanvasElement, parts: Part[], from: Camera, look: Look): void {
    const { width, height } = to;
    if (!width || !height) return;
    const gl = context(width, height);
    if (!gl) return sayLacking(to);
    const mapped = parts.some((p) => p.colours);
    ambient.intensity = mapped ? 2.2 : 1.1;
    light.intensity = mapped ? 0.9 : 2.2;
    holder.clear();
    const toTurn = new T.Group();
    toTurn.quaternion.copy(from.turn);
    const middle = new T.Group();
    middle.position.set(-look.centre[0], -look.centre[1], -look.centre[2]);
    toTurn.add(middle);
    holder.add(toTurn);
    const planes = look.cut === null || look.cut === undefined ? []
        : [new T.Plane(new T.Vector3(0, 0, -1), look.cut * look.radius)];
    for (const part of parts) {
        const geometry = geometryOf(part.shape);
        if (part.colours) {
            // One buffer for all maps of a shape: three gives none back before the geometry goes.
            const held = geometry.getAttribute('color') as Three.BufferAttribute | undefined;
            if (held) {
                held.copyArray(part.colours);
                held.needsUpdate = true;
            } else geometry.setAttribute('color', new T.BufferAttribute(part.colours.slice(), 3));
        }
        const material = materialOf(part, planes.length > 0);
        material.clippingPlanes = planes;
        middle.add(new T.Mesh(geometry, material));
    }
    let point: Three.Points | undefined;
    if (look.mark) {
        const geometry = new T.BufferGeometry().setAttribute('position', new T.BufferAttribute(new Float32Array(look.mark), 3));
        point = new T.Points(geometry, new T.PointsMaterial({ color: 0xd55e00, size: 12, sizeAttenuation: false, depthTest: false }));
        middle.add(point);
    }
    [camera.right, camera.top] = frame(from, look, width / height);
    camera.left = -camera.right;
    camera.bottom = -camera.top;
    camera.near = -10 * look.radius;
    camera.far = 10 * look.radius;
    camera.updateProjectionMatrix();
    gl.setViewport(0, 0, width, height);
    gl.setScissor(0, 0, width, height);
    gl.setScissorTest(true);
    gl.setClearColor(0x000000, 0);
    gl.clear();
    gl.render(scene, camera);
    const pen = to.getContext('2d')!;
    pen.clearRect(0, 0, width, height);
    if (look.background) {
        pen.fillStyle = look.background;
        pen.fillRect(0, 0, width, height);
    }
    pen.drawImage(gl.domElement, 0, gl.domElement.height - height, width, height, 0, 0, width, height);
    if (look.mark && look.markTexts) writeMarks(pen, from, look, width, height);
    if (point) {
        point.geometry.dispose();
        (point.material as Three.PointsMaterial).dispose();
    }
}
