// Shapes in a report, by WebGL alone: three would be half a megabyte of each file. One context draws for all views, which
// turn together.

export interface Solid { positions: Float32Array; normals: Float32Array; indices: Uint32Array }

const glass = document.createElement('canvas');
const gl = glass.getContext('webgl', { antialias: true, alpha: true, premultipliedAlpha: true });
const program = gl?.createProgram() ?? null;

const VERTEX = 'attribute vec3 p,n,c;uniform mat3 r;uniform vec3 o;uniform vec3 s;varying vec3 m,k;void main(){vec3 q=r*(p-o);m=r*n;k=c;gl_Position=vec4(q.xy*s.xy,-q.z*s.z,1.);}';
// Colours are linear, as those of the dashboard.
const FRAGMENT = 'precision mediump float;varying vec3 m,k;uniform float a;void main(){float l=abs(dot(normalize(m),normalize(vec3(-.4,.8,1.))));gl_FragColor=vec4(pow(k*(a+(1.-a)*l),vec3(.4545)),1.);}';

function prepare(): boolean {
    if (!gl || !program || !gl.getExtension('OES_element_index_uint')) return false;
    for (const [type, text] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]] as const) {
        const shader = gl.createShader(type)!;
        gl.shaderSource(shader, text);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.enable(gl.DEPTH_TEST);
    return !!gl.getProgramParameter(program, gl.LINK_STATUS);
}

/** Whether shapes can be drawn here; otherwise tables and charts are all there is. */
export const able = prepare();

/** From where all shapes are seen: a matrix, column by column. */
let turn: number[] = [1, 0, 0, 0, 1, 0, 0, 0, 1];
const watchers = new Set<() => void>();
let asked = 0;

function changed(): void {
    asked ||= requestAnimationFrame(() => {
        asked = 0;
        for (const watcher of [...watchers]) watcher();
    });
}

export function onTurn(watcher: () => void): () => void {
    watchers.add(watcher);
    return () => watchers.delete(watcher);
}

const times = (a: number[], b: number[]): number[] => [0, 1, 2].flatMap((i) => [0, 1, 2].map((j) => a[j] * b[3 * i] + a[j + 3] * b[3 * i + 1] + a[j + 6] * b[3 * i + 2]));

/** By angles about the axes of the screen. */
export function rotate(x: number, y: number): void {
    const [c, s, d, t] = [Math.cos(x), Math.sin(x), Math.cos(y), Math.sin(y)];
    turn = times(times([1, 0, 0, 0, c, s, 0, -s, c], [d, 0, -t, 0, 1, 0, t, 0, d]), turn);
    changed();
}

export function turnTo(matrix: number[]): void {
    turn = matrix;
    changed();
}

let bound: { solid: Solid; buffers: WebGLBuffer[] } | undefined;

/** The shape in the buffers; those of the one before go. */
function bind(context: WebGLRenderingContext, solid: Solid, colours: Float32Array): void {
    for (const buffer of bound?.buffers ?? []) context.deleteBuffer(buffer);
    const list = [solid.positions, solid.normals, colours].map((data, i) => {
        const buffer = context.createBuffer()!;
        const where = context.getAttribLocation(program!, 'pnc'[i]);
        context.bindBuffer(context.ARRAY_BUFFER, buffer);
        context.bufferData(context.ARRAY_BUFFER, data, context.STREAM_DRAW);
        context.enableVertexAttribArray(where);
        context.vertexAttribPointer(where, 3, context.FLOAT, false, 0, 0);
        return buffer;
    });
    const faces = context.createBuffer()!;
    context.bindBuffer(context.ELEMENT_ARRAY_BUFFER, faces);
    context.bufferData(context.ELEMENT_ARRAY_BUFFER, solid.indices, context.STREAM_DRAW);
    bound = { solid, buffers: [...list, faces] };
}

/** Maps are lit little, so that their colours can be read. */
export function draw(to: HTMLCanvasElement, solid: Solid, colours: Float32Array, mapped: boolean, centre: number[], radius: number): void {
    if (!able || !gl || !to.width || !to.height) return;
    const at = (name: string) => gl.getUniformLocation(program!, name);
    glass.width = to.width;
    glass.height = to.height;
    gl.viewport(0, 0, to.width, to.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    bind(gl, solid, colours);
    const aspect = to.width / to.height;
    gl.uniformMatrix3fv(at('r'), false, turn);
    gl.uniform3f(at('o'), centre[0], centre[1], centre[2]);
    gl.uniform3f(at('s'), 0.95 / radius / Math.max(1, aspect), 0.95 / radius / Math.max(1, 1 / aspect), 0.4 / radius);
    gl.uniform1f(at('a'), mapped ? 0.6 : 0.2);
    gl.drawElements(gl.TRIANGLES, solid.indices.length, gl.UNSIGNED_INT, 0);
    const pen = to.getContext('2d')!;
    pen.clearRect(0, 0, to.width, to.height);
    pen.drawImage(glass, 0, 0);
}
