// A report of one page that opens offline: what is on the page, with shapes that turn, and a paragraph on methods.
import type { Job } from './api';
import { svgText } from './charts';
import type { Surface3 } from './glb';
import { VIEWER } from './report_viewer';
import { shown } from './shape';
import { save } from './ui';

const STYLE = `body{font:15px/1.5 Georgia,serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#222;background:#fff}
h1,h2,h3{font-family:Helvetica,Arial,sans-serif}figure{display:inline-block;margin:.5rem;vertical-align:top;max-width:28rem}figcaption span{margin-left:.4em}
img,svg,canvas{max-width:100%}svg{width:26rem}svg.bar{width:15rem}table{border-collapse:collapse;font-size:13px}td,th{border:1px solid #ccc;padding:.15rem .5rem;text-align:left}
dt{font-weight:bold}dd{margin:0 0 .3rem 1rem;overflow-wrap:anywhere}code,pre{font-size:12px;overflow-wrap:anywhere;white-space:pre-wrap}.big{font-size:1.3em}.quiet{color:#555}`;

const METHODS: Record<string, string> = {
    pca: 'Shapes were registered elastically to their mean in the space of square-root normal fields (SRNFs), and principal components were taken there.',
    mean: 'The mean was taken in the space of square-root normal fields (SRNFs), with all shapes registered to it elastically.',
    'compare-groups': 'Two groups were compared by a permutation test of the distance between their means in the space of square-root normal fields (SRNFs); p at each point is corrected for all points.',
    classify: 'Labels were predicted by leave-one-out over subjects.',
    distances: 'Pairs of shapes were compared by distances of their square-root normal fields (SRNFs).',
    geodesic: 'The path between both shapes is a geodesic of square-root normal fields (SRNFs), inverted at each step.',
};

const escaped = (text: string): string => text.replace(/[&<>"]/g, (c) => ({ '&': '&amp;', '<': '&lt;', '>': '&gt;', '"': '&quot;' })[c]!);

function optionsOf(job: Job): string {
    const said = Object.entries(job.inputs ?? {}).filter(([, v]) => v !== null && typeof v !== 'object').map(([k, v]) => `${k} = ${v}`);
    return said.length ? ` Options: ${said.join(', ')}.` : '';
}

function base64(data: ArrayBuffer): string {
    const list = new Uint8Array(data);
    let text = '';
    for (let i = 0; i < list.length; i += 8192) text += String.fromCharCode(...list.subarray(i, i + 8192));
    return btoa(text);
}

/** Shapes as a report carries them: positions in 16 bits about the centre, colours in 8, lists of faces once each. */
class Carried {
    private lists: string[] = [];
    private shapes: object[] = [];
    private known = new Map<Surface3['indices'], number>();
    turn: number[] = [1, 0, 0, 0, 1, 0, 0, 0, 1];
    add(canvas: HTMLCanvasElement): number | null {
        const held = shown.get(canvas);
        if (!held || held.parts.length !== 1) return null;
        const { shape, colours } = held.parts[0];
        const { centre, radius } = held.look;
        let list = this.known.get(shape.indices);
        if (list === undefined) {
            const text = base64(shape.indices.slice().buffer);
            list = this.lists.indexOf(text);
            if (list < 0) list = this.lists.push(text) - 1;
            this.known.set(shape.indices, list);
        }
        const positions = Int16Array.from(shape.positions, (v, i) => Math.max(-32767, Math.min(32767, Math.round((32767 * (v - centre[i % 3])) / radius))));
        const back = (c: number) => (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055);
        const bright = colours && Uint8Array.from(colours, (c) => Math.round(255 * back(c)));
        this.turn = held.camera.matrix();
        return this.shapes.push({ list, positions: base64(positions.buffer), colours: bright && base64(bright.buffer) }) - 1;
    }
    text(): string {
        return JSON.stringify({ turn: this.turn, lists: this.lists, shapes: this.shapes });
    }
}

export async function makeReport(title: string, from: HTMLElement, job?: Job): Promise<void> {
    const copy = from.cloneNode(true) as HTMLElement;
    const carried = new Carried();
    const canvases = from.querySelectorAll('canvas');
    copy.querySelectorAll('canvas').forEach((canvas, i) => {
        const image = document.createElement('img');
        image.src = canvases[i].toDataURL('image/png');
        image.alt = (canvases[i].getAttribute('aria-label') ?? '').replace(/ Arrows turn it.*$/, '');
        image.width = canvases[i].clientWidth;
        image.height = canvases[i].clientHeight;
        const number = carried.add(canvases[i]);
        if (number !== null) image.dataset.shape = `${number}`;
        canvas.replaceWith(image);
    });
    const charts = from.querySelectorAll<SVGElement>('svg');
    copy.querySelectorAll('svg').forEach((svg, i) => {
        const holder = document.createElement('div');
        holder.innerHTML = svgText(charts[i]);
        const made = holder.firstElementChild!;
        made.removeAttribute('width');
        made.removeAttribute('height');
        svg.replaceWith(made);
    });
    copy.querySelectorAll('.no-report, button, input, select, details.menu').forEach((node) => node.remove());
    const methods = job
        ? `<h2>Methods</h2><p>${escaped(`${METHODS[job.process] ?? `The process ${job.process} was used.`}${optionsOf(job)} Computed with ${job.build ?? 'srnfd'}, job ${job.id}, ${job.finished ?? ''}.`)}</p>` : '';
    const page = `<!doctype html><html lang="en"><head><meta charset="utf-8"><title>${escaped(title)}</title>
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"><style>${STYLE}</style></head>
<body><h1>${escaped(title)}</h1><p class="quiet">srnfd, ${new Date().toISOString().slice(0, 10)}</p>${copy.innerHTML}${methods}
<script type="application/json" id="shapes">${carried.text()}</script><script>${VIEWER}</script></body></html>`;
    save(`${title.replace(/[^A-Za-z0-9._-]+/g, '-')}.html`, page, 'text/html;charset=utf-8');
}
