// Fields of forms that are more than one input: points of covariates at which shapes are predicted, numbers by name, shapes
// by the parts of a model, and a shape that is sent from the form.
import type { ComponentChildren } from 'preact';
import { useRef, useState } from 'preact/hooks';
import * as api from './api';
import { covariatesOf, namesIn, placesAlong } from './formula';
import type { Covariate } from './formula';
import { t } from './i18n';

type Row = Record<string, unknown>;

function parsed<T>(text: string, fallback: T): T {
    try {
        return JSON.parse(text) ?? fallback;
    } catch {
        return fallback;
    }
}

/** What was typed as the covariate has it: a number where all members have numbers. */
function typed(text: string, covariate?: Covariate): unknown {
    const clean = text.trim();
    if (!covariate || covariate.numeric) return clean !== '' && Number.isFinite(Number(clean)) ? Number(clean) : clean;
    return covariate.levels.find((l) => `${l}` === clean) ?? clean;
}

/** Names that points can have: those of the formula, and time where slopes are asked for. */
export function namesOfPoints(process: string, texts: Record<string, string>): string[] {
    const names = namesIn(texts.formula ?? '');
    return process === 'trajectories' ? ['time', ...names.filter((n) => n !== 'time')] : names;
}

export function PointsField({ id, names, members, text, set }: { id: string; names: string[]; members: api.Member[]; text: string; set: (text: string) => void }) {
    const list = parsed<Row[]>(text, []);
    const rows = Array.isArray(list) ? list : [];
    const covariates = covariatesOf(members, names);
    const all = [...new Set([...names, ...rows.flatMap((r) => Object.keys(r))])];
    const put = (next: Row[]) => set(next.length ? JSON.stringify(next) : '');
    const change = (i: number, name: string, value: string) => put(rows.map((row, k) => {
        if (k !== i) return row;
        const { [name]: _, ...rest } = row;
        return value.trim() === '' ? rest : { ...rest, [name]: typed(value, covariates.find((c) => c.name === name)) };
    }));
    if (!all.length) return <p class="quiet" id={id}>{t`Write the formula first: points have the covariates that it names.`}</p>;
    return (
        <div id={id} role="group" aria-label={t`Points`}>
            {rows.length > 0 && (
                <div class="scroll" tabIndex={0} role="region" aria-label={t`Points of covariates`}><table>
                    <thead><tr>{all.map((name) => <th scope="col">{name}</th>)}<th scope="col"><span class="sr">{t`Remove`}</span></th></tr></thead>
                    <tbody>{rows.map((row, i) => (
                        <tr>{all.map((name) => <td><input class="cell" aria-label={t`${name} of point ${i + 1}`} list={`levels-${name}`} value={row[name] === undefined ? '' : `${row[name]}`} placeholder={t`as usual`} onChange={(e) => change(i, name, e.currentTarget.value)} /></td>)}
                            <td><button type="button" aria-label={t`Remove point ${i + 1}`} onClick={() => put(rows.filter((_, k) => k !== i))}>{t`Remove`}</button></td></tr>
                    ))}</tbody>
                </table></div>
            )}
            {covariates.map((c) => <datalist id={`levels-${c.name}`}>{placesAlong(c).map((v) => <option value={`${v}`} />)}</datalist>)}
            <div class="actions">
                <button type="button" onClick={() => put([...rows, covariates.length ? { [covariates[0].name]: covariates[0].numeric ? covariates[0].low : covariates[0].levels[0] } : {}])}>{t`Add a point`}</button>
                {covariates.map((c) => <button type="button" onClick={() => put([...rows, ...placesAlong(c).map((v) => ({ [c.name]: v }))])}>{c.numeric ? t`Five along ${c.name}` : t`Each ${c.name}`}</button>)}
                {rows.length > 0 && <button type="button" onClick={() => put([])}>{t`None`}</button>}
            </div>
        </div>
    );
}

/** A number for each name, which is usual where the field is empty. */
export function NumbersField({ id, names, text, set }: { id: string; names: string[]; text: string; set: (text: string) => void }) {
    const given = parsed<Row>(text, {});
    const all = [...new Set([...names, ...Object.keys(given)])];
    const change = (name: string, value: string) => {
        const { [name]: _, ...rest } = given;
        const next = value.trim() === '' ? rest : { ...rest, [name]: Number(value) };
        set(Object.keys(next).length ? JSON.stringify(next) : '');
    };
    if (!all.length) return <p class="quiet" id={id}>{t`Choose what it is of first.`}</p>;
    return (
        <div id={id} class="row" role="group" aria-label={t`Numbers by name`}>{all.map((name) => (
            <label>{name} <input type="number" step="any" value={given[name] === undefined ? '' : `${given[name]}`} placeholder={t`usual`} onInput={(e) => change(name, e.currentTarget.value)} /></label>
        ))}</div>
    );
}

/** Levels of a covariate among members. */
export const levelsOf = (members: api.Member[], name: string): string[] => covariatesOf(members, [name]).flatMap((c) => c.levels.map((l) => `${l}`));

// ---- Shapes -----------------------------------------------------------------------------------------------------------

interface Choice { id: string; name: string }

/** A choice of shapes, and a way to send one: a file that is chosen, or dropped on it. */
export function SendShape({ able, sent, children }: { able: boolean; sent: (shape: Choice) => void; children: ComponentChildren }) {
    const input = useRef<HTMLInputElement>(null);
    const [told, setTold] = useState('');
    const [wrong, setWrong] = useState('');
    const [over, setOver] = useState(false);
    const send = async (file?: File) => {
        if (!file) return;
        setWrong('');
        setTold(t`Sending ${file.name}…`);
        const name = file.name.replace(/\.gz$/i, '').replace(/\.[^.]*$/, '').slice(0, 255);
        try {
            const mesh = await api.upload<api.Mesh>(`/v1/meshes?name=${encodeURIComponent(name)}`, file, 'application/octet-stream', () => {});
            sent({ id: mesh.id, name: `${mesh.name || mesh.id} (mesh)` });
            setTold(t`${file.name} was sent, and chosen.`);
            if (!mesh.report.analysable) setWrong(t`It cannot be analysed: ${mesh.report.problems[0]?.detail ?? ''}`);
        } catch (error) {
            setTold('');
            setWrong(`${file.name}: ${(error as Error).message}`);
        }
    };
    if (!able) return <>{children}</>;
    return (
        <div class={over ? 'over' : ''} onDragOver={(e) => { e.preventDefault(); setOver(true); }} onDragLeave={() => setOver(false)}
            onDrop={(e) => { e.preventDefault(); setOver(false); void send(e.dataTransfer?.files[0]); }}>
            {children}
            <div class="actions">
                <button type="button" onClick={() => input.current!.click()}>{t`Send a mesh`}</button>
                <span class="quiet">{t`or drop its file here`}</span>
            </div>
            <input ref={input} type="file" hidden aria-label={t`Mesh to send`} onChange={(e) => { void send(e.currentTarget.files?.[0]); e.currentTarget.value = ''; }} />
            {told && <p class="quiet" role="status">{told}</p>}
            {wrong && <p class="wrong" role="alert">{wrong}</p>}
        </div>
    );
}

/** A shape for each part of a model. */
export function PartsField({ id, names, shapes, text, set, sent }: { id: string; names: string[]; shapes: Choice[]; text: string; set: (text: string) => void; sent: (shape: Choice) => void }) {
    const given = parsed<Record<string, string>>(text, {});
    const change = (name: string, shape: string) => {
        const { [name]: _, ...rest } = given;
        const next = shape ? { ...rest, [name]: shape } : rest;
        set(Object.keys(next).length ? JSON.stringify(next) : '');
    };
    return (
        <div id={id} role="group" aria-label={t`Shapes of the parts`}>{names.map((name, i) => (
            <div class="field" key={name}>
                <label for={`${id}-${i}`}>{name}</label>
                <SendShape able sent={(s) => { sent(s); change(name, s.id); }}>
                    <select id={`${id}-${i}`} value={given[name] ?? ''} onChange={(e) => change(name, e.currentTarget.value)}>
                        <option value="">{t`choose a shape`}</option>
                        {given[name] && !shapes.some((s) => s.id === given[name]) && <option value={given[name]}>{given[name]}</option>}
                        {shapes.map((s) => <option value={s.id}>{s.name}</option>)}
                    </select>
                </SendShape>
            </div>
        ))}</div>
    );
}
