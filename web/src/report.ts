// A report of one page that opens offline. The service makes it (the process report); for those who may not start
// anything the page makes one of what it shows, in the same frame.
import * as api from './api';
import type { Job } from './api';
import { svgText } from './charts';
import type { Surface3 } from './glb';
import { mayChange } from './state';
import { shown } from './shape';
import { save } from './text';

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

/** Shapes as a report carries them (report_view.tsx), with the colours that they have on the page. */
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
        return this.shapes.push({ list, centre, radius, positions: base64(positions.buffer), colours: bright && base64(bright.buffer) }) - 1;
    }
    text(): string {
        const lists = this.lists.map((data) => ({ bits: 32, data }));
        return JSON.stringify({ turn: this.turn, lists, shapes: this.shapes, views: this.shapes.map((_, i) => ({ shapes: [i] })), sections: [] });
    }
}

const fileName = (title: string): string => `${title.replace(/[^A-Za-z0-9._-]+/g, '-')}.html`;

/** What is on the page, in the frame of reports. */
async function makeOfPage(title: string, from: HTMLElement, job?: Job): Promise<void> {
    const frame = await (await api.request('/ui/report.html')).text();
    const copy = from.cloneNode(true) as HTMLElement;
    const carried = new Carried();
    const canvases = from.querySelectorAll('canvas');
    copy.querySelectorAll('canvas').forEach((canvas, i) => {
        const image = document.createElement('img');
        image.src = canvases[i].toDataURL('image/png');
        image.alt = (canvases[i].getAttribute('aria-label') ?? '').replace(/ Arrows turn it.*$/, '');
        const number = carried.add(canvases[i]);
        const holder = document.createElement('div');
        if (number !== null) holder.dataset.view = `${number}`;
        holder.append(image);
        canvas.replaceWith(holder);
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
    copy.querySelectorAll('[style]').forEach((node) => node.removeAttribute('style'));
    const methods = job
        ? `<h2>Methods</h2><p>${escaped(`Process ${job.process} of srnfd.${optionsOf(job)} Numeric build ${job.build ?? 'unknown'}, job ${job.id}, ${job.finished ?? ''}.`)}</p>` : '';
    const parts: Record<string, string> = {
        title: escaped(title), body: `<h1>${escaped(title)}</h1>${copy.innerHTML}${methods}`, data: carried.text(),
    };
    save(fileName(title), frame.replace(/<!--(title|body|data)-->/g, (_, name) => parts[name]), 'text/html;charset=utf-8');
}

/** The report of a job, or of what the page shows. */
export async function makeReport(title: string, from: HTMLElement, job?: Job, id = job?.id): Promise<void> {
    if (!id || !mayChange()) return makeOfPage(title, from, job);
    const made = await api.run('report', { jobs: [id], title });
    save(fileName(title), made.html, 'text/html;charset=utf-8');
}
