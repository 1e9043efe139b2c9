// Shapes that single steps made, beside what they were made of, and what was done to them in words.
import type { ComponentChildren } from 'preact';
import { useState } from 'preact/hooks';
import * as api from './api';
import { Curve, DataTable } from './charts';
import { t, whole } from './i18n';
import { namesOf } from './names';
import { Linked } from './paths';
import { link } from './router';
import { Shape, surfacePath } from './shape';
import { FORMATS, LongTable, figure, plural, useLoad } from './ui';

const TINY = 1e-5;
const percent = (v: number | null | undefined, digits = 3): string => (typeof v !== 'number' ? '–' : v !== 0 && Math.abs(v) < TINY ? t`less than 0.001 %` : `${figure(100 * v, digits)} %`);
const idOf = (value: any): string | undefined => (typeof value === 'string' ? value : value?.id ?? value?.surface ?? value?.mesh);
const isMesh = (id: string): boolean => id.startsWith('mesh-');

type Facts = [string, ComponentChildren][];
type Origin = [id: string | undefined, title: string];

/** What was made, large; what it was made of, in views that turn with each other; and facts. */
function Made({ id, name, title, of, facts, children }: { id: string; name: string; title: string; of: Origin[]; facts: Facts; children?: ComponentChildren }) {
    const mesh = isMesh(id);
    const files: [string, string][] = FORMATS.map((f) => [f, mesh ? `/v1/meshes/${id}/content?format=${f}` : `/v1/surfaces/${id}/mesh?format=${f}&resolution=48`]);
    return (
        <>
            <div class="split">
                <div>
                    <h2>{title}</h2>
                    <Shape src={mesh ? `/v1/meshes/${id}/content?format=glb` : surfacePath(id, 32)} mesh={mesh ? id : undefined} label={title} name={name || 'shape'} downloads={files} />
                    <div class="actions no-report"><a class="button" href={link(mesh ? 'meshes' : 'shapes', id)}>{t`Open, download`}</a></div>
                </div>
                <div>
                    <dl class="pairs">{facts.map(([what, text]) => <><dt>{what}</dt><dd>{text}</dd></>)}</dl>
                    {of.some(([from]) => from) && <div class="gallery">{of.map(([from, caption]) => from && <Linked key={`${from}${caption}`} id={from} title={caption} />)}</div>}
                </div>
            </div>
            {children}
        </>
    );
}

const solved = (energy: number | null): string => t`${figure(energy, 2)} (0: the shape exists)`;

// ---- Meshes --------------------------------------------------------------------------------------------------------

const meshFacts = (mesh: api.Mesh): Facts => [
    [t`Vertices, faces`, `${whole(mesh.vertices)}, ${whole(mesh.faces)}`],
    [t`Area, volume`, t`${figure(mesh.report.area, 5)}, ${figure(mesh.report.volume, 5)} in the units of the file`],
    [t`Can be analysed`, mesh.report.analysable ? t`yes` : <span class="wrong">{t`no: ${mesh.report.problems.map((p) => p.detail).join(' ')}`}</span>],
];

export function Extracted({ result }: { result: api.Outputs<'extract'> }) {
    const { mesh, changed } = result;
    const places: any[] = changed?.places ?? [];
    return (
        <Made id={mesh.id} name={mesh.name} title={mesh.name || t`The structure`} of={[]} facts={[
            ...meshFacts(mesh),
            [t`Voxels`, t`${whole(result.voxels)}; the volume of the mesh differs from theirs by ${percent(result.volumeChange, 2)}`],
            [t`Changed for one closed surface without handles`, changed?.voxels ? t`${plural(changed.voxels, 'voxel')} (${changed.added} added, ${changed.removed} removed)` : t`nothing`],
            [t`Smoothing`, t`${plural(result.smoothing, 'pass', 'passes')}, then ${figure(result.offset, 2)} mm outwards to give the volume back`],
            [t`Faces that cross`, result.crossings ? <span class="wrong">{plural(result.crossings, 'pair')}</span> : t`none`],
        ]}>
            {places.length > 0 && <><h2>{t`What was changed`}</h2><DataTable rows={[[t`change`, t`voxels`, t`x (mm)`, 'y', 'z'], ...places.map((p) => [api.words(p.change), p.voxels, ...p.position])]} /></>}
        </Made>
    );
}

const CHANGES = ['what', t`how many`, 'first', 'x', 'y', 'z'];
const changeRow = (c: any) => [api.words(`${c.code}`.replace(/-/g, ' ')), c.count, c.first === null ? '–' : `${c.element} ${c.first}`, ...(c.position ?? ['–', '–', '–'])];

export function Repaired({ result }: { result: api.Outputs<'repair'> }) {
    const given = idOf(result.inputs?.mesh);
    const same = given === result.mesh.id;
    return (
        <Made id={result.mesh.id} name={result.mesh.name} title={same ? t`The mesh: nothing was changed` : t`The repaired mesh`} of={[[same ? undefined : given, t`as it was sent`]]} facts={[
            ...meshFacts(result.mesh),
            [t`Distance between both`, t`${figure(result.distance.rms)} (root mean square), ${figure(result.distance.max)} at most`],
        ]}>
            {result.changes.length > 0 && <><h2>{t`What was changed`}</h2><DataTable rows={[CHANGES, ...result.changes.map(changeRow)]} /></>}
            {result.refused.map((r: any) => <div class="problem"><strong>{r.code}</strong><p>{r.detail}</p></div>)}
        </Made>
    );
}

export function Mirrored({ result }: { result: api.Outputs<'mirror'> }) {
    const made: any = result.mesh ?? result.surface;
    const given = idOf(result.inputs?.mesh) ?? idOf(result.inputs?.surface);
    return <Made id={made.id} name={made.name} title={t`The mirror image`} of={[[given, t`as it was sent`]]} facts={[[t`Plane`, result.inputs?.plane ?? t`sagittal`], [t`Orientation`, t`kept: faces are outward as before`]]} />;
}

// ---- Surfaces ------------------------------------------------------------------------------------------------------

function EncodedCohort({ result }: { result: any }) {
    const [chosen, setChosen] = useState<any>();
    const rows: any[] = result.rows;
    const names = useLoad(() => namesOf(rows.map((r) => r.id)), [result]);
    const nameOf = (r: any): string => names.value?.get(r.id) ?? r.subject ?? r.id;
    return (
        <>
            <p class="big">{t`${result.encoded} of ${plural(rows.length, 'member')} encoded`}{result.failed ? <span class="wrong">{t`, ${result.failed} could not be`}</span> : null}</p>
            {result.cohort && <p><a href={link('cohorts', result.cohort)}>{t`The cohort ${result.cohort}`}</a></p>}
            <div class="split">
                <LongTable label={t`Members and their encodings`} items={rows} keyOf={(r) => `${r.member}`}
                    columns={[{ title: t`Member` }, { title: t`Label`, width: '6rem' }, { title: t`Route`, width: '5rem' }, { title: t`Fit`, width: '5rem' }, { title: t`Problem` }]}
                    row={(r) => [
                        r.surface ? <button class="plain-button" aria-pressed={chosen === r} onClick={() => setChosen(r)}>{nameOf(r)}</button> : nameOf(r),
                        r.label ?? '–',
                        r.route ?? '–', percent(r.fit?.relativeToDiagonal?.rms), r.problem ? <span class="wrong" title={r.problem.detail}>{r.problem.code}: {r.problem.detail}</span> : '–',
                    ]} />
                {chosen ? <div class="gallery"><Linked key={chosen.surface} id={chosen.surface} title={t`encoded`} />{isMesh(chosen.id) && <Linked key={chosen.id} id={chosen.id} title={t`as it was sent`} />}</div>
                    : <p class="quiet no-report">{t`Choose a member to see its encoding. Fit: root mean square of the distance from the mesh, of its diagonal.`}</p>}
            </div>
        </>
    );
}

export function Encoded({ result }: { result: api.Outputs<'encode'> }) {
    if (result.rows) return <EncodedCohort result={result} />;
    const { fit, distortion, starShaped } = result;
    const near = fit?.relativeToDiagonal ?? {};
    return (
        <Made id={result.surface.id} name={result.surface.name} title={t`The surface`} of={[[idOf(result.inputs?.mesh), t`the mesh`]]} facts={[
            [t`Degree`, `${result.surface.lmax}`],
            [t`Distance from the mesh`, t`${figure(fit?.rms)} (root mean square, ${percent(near.rms)} of the diagonal); 95 % within ${figure(fit?.p95)}, all within ${figure(fit?.max)}`],
            [t`Volume, area`, t`differ from those of the mesh by ${percent(fit?.volumeDifference, 2)} and ${percent(fit?.areaDifference, 2)}`],
            [t`Route to the sphere`, `${result.route}: ${result.reason}`],
            [t`Star-shaped`, starShaped?.value ? t`yes, by ${figure(starShaped.margin)}` : starShaped ? t`no: from the best centre ${percent(starShaped.violatingAreaFraction)} of the area is seen from behind` : '–'],
            ...(distortion ? [[t`Distortion of the map`, t`${figure(distortion.symmetricDirichlet)} (4 is an isometry); areas vary by ${figure(distortion.logAreaDeviation)} (log)${distortion.flipped ? t`; ${distortion.flipped} faces turned over` : ''}`]] as Facts : []),
        ]}>
            {idOf(result.inputs?.mesh) && <div class="actions no-report"><a class="button" href={`${link('meshes', idOf(result.inputs?.mesh)!)}?with=${result.surface.id}&map=between`}>{t`What was lost, on the mesh`}</a></div>}
        </Made>
    );
}

const STOPPED: Record<string, string> = {
    tolerance: 'solved', stationary: t`at a minimum above 0: no surface has this field`, maxIterations: t`was still falling when the iterations ended`, closedForm: t`what the closed form gives`,
};

export function Inverted({ result }: { result: api.Outputs<'invert'> }) {
    const { certificate } = result;
    const steps: any[] = result.history ?? [];
    return (
        <Made id={result.surface.id} name={result.surface.name} title={t`The surface of the field`} of={[[idOf(result.inputs?.srnf), t`where the field is from`]]} facts={[
            [t`Relative energy`, <span class={result.converged ? '' : 'wrong'}>{figure(result.relativeEnergy, 3)}, {STOPPED[result.stopped as string] ?? result.stopped}</span>],
            [t`Method`, `${result.method}, ${plural(result.iterations, 'iteration')}`],
            [t`Only one`, certificate ? (certificate.unique ? t`yes: certified` : t`not certified`) : t`not asked`],
            [t`Distance from the true surface`, result.surfaceErrorBound === null ? t`no bound` : t`at most ${figure(result.surfaceErrorBound)}`],
            ...(result.flipped ? [[t`Mirror image`, t`was found first, and turned back`]] as Facts : []),
        ]}>
            {steps.length > 2 && <div class="split"><Curve title={t`Energy, by iteration (log 10)`} name="energy" labels={[t`iteration`, t`log 10 of the energy`]}
                points={steps.filter((s) => s.energy > 0).map((s) => ({ x: s.iteration, y: Math.log10(s.energy) }))} /></div>}
        </Made>
    );
}

export function Transported({ result }: { result: api.Outputs<'transport'> }) {
    const { from, to } = result.inputs ?? {};
    const lost = result.norm > 0 ? result.residual / result.norm : 0;
    return <Made id={result.surface.id} name={result.surface.name} title={t`Where the vector leads`} of={[[idOf(from), t`from: where the vector was`], [idOf(to), t`to: where it was brought`]]} facts={[
        [t`Length of the vector`, figure(result.norm)],
        [t`Part that no motion gives`, `${percent(lost)} (${figure(result.residual)})`],
        [t`Relative energy`, solved(result.relativeEnergy)],
    ]} />;
}

export function Transferred({ result }: { result: api.Outputs<'transfer'> }) {
    const { source, deformed, target } = result.inputs ?? {};
    return <Made id={result.surface.id} name={result.surface.name} title={t`The target, deformed as the source was`} of={[[idOf(source), t`source`], [idOf(deformed), t`source, deformed`], [idOf(target), t`target`]]} facts={[
        [t`Size`, t`${figure(result.sizeRatio)} times that of the source`],
        [t`Relative energy`, solved(result.relativeEnergy)],
    ]} />;
}

// ---- Samples -------------------------------------------------------------------------------------------------------

const COLUMNS = 8;

export function Sampled({ result }: { result: api.Outputs<'sample'> }) {
    const scores = result.scores as number[][];
    const model = idOf(result.inputs?.model);
    const shown = Math.min(COLUMNS, scores[0]?.length ?? 0);
    return (
        <>
            <p>{t`${plural(result.surfaces.length, 'random shape')} of`} {model ? <a href={link('models', model)}>{t`the model`}</a> : t`a model`}{t`, drawn by seed ${result.inputs?.seed ?? 0}.`}</p>
            <div class="gallery">{result.surfaces.map((s, i) => (
                <div><Linked id={s.id} title={t`${s.name || i + 1}, relative energy ${figure(result.relativeEnergy[i], 2)}`} /><a class="no-report" href={link('shapes', s.id)}>{t`Open, download`}</a></div>
            ))}</div>
            <p class="quiet">{t`Relative energy 0: the shape exists.`}</p>
            <h2>{t`Scores`}</h2>
            <DataTable rows={[[t`shape`, ...Array.from({ length: shown }, (_, k) => t`component ${k + 1}`)], ...scores.map((row, i) => [result.surfaces[i]?.name || i + 1, ...row.slice(0, shown)])]} />
        </>
    );
}
