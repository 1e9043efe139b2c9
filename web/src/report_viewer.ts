// What turns the shapes of a report: a script of its own, without three, that a report carries as text. Where there is
// no WebGL the pictures stay.

export const VIEWER = `(() => {
const shapes = JSON.parse(document.getElementById('shapes').textContent);
const glass = document.createElement('canvas');
const gl = glass.getContext('webgl', { antialias: true, alpha: true, premultipliedAlpha: true });
if (!gl || !gl.getExtension('OES_element_index_uint')) return;
const raw = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const shader = (type, text) => { const s = gl.createShader(type); gl.shaderSource(s, text); gl.compileShader(s); gl.attachShader(program, s); };
const program = gl.createProgram();
shader(gl.VERTEX_SHADER, 'attribute vec3 p,n,c;uniform mat3 r;uniform vec2 s;varying vec3 m,k;void main(){vec3 q=r*p;m=r*n;k=c;gl_Position=vec4(q.xy*s,-q.z*.4,1.);}');
shader(gl.FRAGMENT_SHADER, 'precision mediump float;varying vec3 m,k;uniform float a;void main(){float l=abs(dot(normalize(m),normalize(vec3(-.4,.8,1.))));gl_FragColor=vec4(k*(a+(1.-a)*l),1.);}');
gl.linkProgram(program);
gl.useProgram(program);
gl.enable(gl.DEPTH_TEST);
const at = (name) => gl.getUniformLocation(program, name);
const buffer = (target, data) => { const b = gl.createBuffer(); gl.bindBuffer(target, b); gl.bufferData(target, data, gl.STATIC_DRAW); return b; };
const lists = shapes.lists.map((text) => new Uint32Array(raw(text)));
const indices = lists.map((list) => buffer(gl.ELEMENT_ARRAY_BUFFER, list));
const views = [...document.querySelectorAll('img[data-shape]')].map((image) => {
    const given = shapes.shapes[+image.dataset.shape];
    const list = lists[given.list];
    const whole = new Int16Array(raw(given.positions));
    const p = Float32Array.from(whole, (v) => v / 32767);
    const n = new Float32Array(p.length);
    for (let f = 0; f < list.length; f += 3) {
        const [a, b, c] = [3 * list[f], 3 * list[f + 1], 3 * list[f + 2]];
        const u = [0, 1, 2].map((k) => p[b + k] - p[a + k]);
        const v = [0, 1, 2].map((k) => p[c + k] - p[a + k]);
        const x = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        for (const i of [a, b, c]) for (let k = 0; k < 3; k++) n[i + k] += x[k];
    }
    const c = given.colours ? Float32Array.from(new Uint8Array(raw(given.colours)), (v) => v / 255)
        : Float32Array.from(p, (_, i) => [0.784, 0.69, 0.565][i % 3]);
    const canvas = document.createElement('canvas');
    canvas.width = 2 * image.width;
    canvas.height = 2 * (image.height || image.width);
    canvas.style.cssText = 'width:' + image.width + 'px;max-width:100%;touch-action:none;cursor:grab';
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', image.alt + ' Drag or arrows turn it.');
    image.replaceWith(canvas);
    return { canvas, given, count: list.length, index: indices[given.list], flat: given.colours ? 0.7 : 0.35,
        data: [p, n, c].map((d) => buffer(gl.ARRAY_BUFFER, d)) };
});
let turn = shapes.turn;
const times = (a, b) => [0, 1, 2].flatMap((i) => [0, 1, 2].map((j) => a[j] * b[3 * i] + a[j + 3] * b[3 * i + 1] + a[j + 6] * b[3 * i + 2]));
const rotate = (x, y) => {
    const [c, s, d, t] = [Math.cos(x), Math.sin(x), Math.cos(y), Math.sin(y)];
    turn = times(times([1, 0, 0, 0, c, s, 0, -s, c], [d, 0, -t, 0, 1, 0, t, 0, d]), turn);
    requestAnimationFrame(paint);
};
function paint() {
    for (const view of views) {
        const { canvas } = view;
        glass.width = canvas.width;
        glass.height = canvas.height;
        gl.viewport(0, 0, canvas.width, canvas.height);
        gl.clearColor(0, 0, 0, 0);
        gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
        const aspect = canvas.width / canvas.height;
        gl.uniformMatrix3fv(at('r'), false, turn);
        gl.uniform2f(at('s'), 0.95 / Math.max(1, aspect), 0.95 / Math.max(1, 1 / aspect));
        gl.uniform1f(at('a'), view.flat);
        ['p', 'n', 'c'].forEach((name, i) => {
            const where = gl.getAttribLocation(program, name);
            gl.bindBuffer(gl.ARRAY_BUFFER, view.data[i]);
            gl.enableVertexAttribArray(where);
            gl.vertexAttribPointer(where, 3, gl.FLOAT, false, 0, 0);
        });
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, view.index);
        gl.drawElements(gl.TRIANGLES, view.count, gl.UNSIGNED_INT, 0);
        const pen = canvas.getContext('2d');
        pen.clearRect(0, 0, canvas.width, canvas.height);
        pen.drawImage(glass, 0, 0);
    }
}
for (const { canvas } of views) {
    let hold = null;
    canvas.onpointerdown = (e) => { hold = [e.clientX, e.clientY]; canvas.setPointerCapture(e.pointerId); };
    canvas.onpointerup = canvas.onpointercancel = () => { hold = null; };
    canvas.onpointermove = (e) => { if (hold) { rotate((e.clientY - hold[1]) / 120, (e.clientX - hold[0]) / 120); hold = [e.clientX, e.clientY]; } };
    canvas.onkeydown = (e) => {
        const by = { ArrowLeft: [0, -0.15], ArrowRight: [0, 0.15], ArrowUp: [-0.15, 0], ArrowDown: [0.15, 0] }[e.key];
        if (by) { rotate(...by); e.preventDefault(); }
    };
}
paint();
})();`;
