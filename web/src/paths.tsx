// Shapes that analyses name: one in a view that turns with the others, and several along a path, as an animation.
import { useEffect, useMemo, useState } from 'preact/hooks';
import type * as api from './api';
import { normalsOf } from './geometry';
import { t } from './i18n';
import { aNumber, useKept } from './kept';
import { MontageButton } from './montage';
import { link } from './router';
import { PictureButtons, View, linked, shapeAt, shapePath, surfacePath, useShape } from './shape';
import { Camera, moved } from './stage';
import { ProblemBox, Shown, figure, useLoad } from './ui';

/** A shape in a view that turns with the others, or a word that it comes. */
export function Linked({ id, title, resolution = 24, colour }: { id: string; title: string; resolution?: number; colour?: string }) {
    const { shape, error } = useShape(shapePath(id, resolution));
    const own = useMemo(() => new Camera(), []);
    const [alone, setAlone] = useState(false);
    if (error) return <ProblemBox error={error} />;
    return (
        <figure class="shape">
            {shape ? <View parts={[{ shape, colour }]} camera={alone ? own : linked} label={title} onLink={() => setAlone(!alone)} />
                : <div class="view" aria-busy="true" />}
            <figcaption>{title}{alone ? t` (turns alone)` : ''}</figcaption>
        </figure>
    );
}

const PICTURED_MAX = 9;

/** Surfaces in a row, between which the shown one is interpolated. */
export function Path({ surfaces, texts, energies }: { surfaces: api.Surface[]; texts: string[]; energies?: (number | null)[] }) {
    const loaded = useLoad(() => Promise.all(surfaces.map((s) => shapeAt(surfacePath(s.id)))), [surfaces]);
    const [at, setAt] = useKept('at', 0, aNumber(0, surfaces.length - 1));
    const [playing, setPlaying] = useState(false);
    const [version, setVersion] = useState(0);
    const moving = useMemo(() => loaded.value && { ...loaded.value[0], positions: loaded.value[0].positions.slice(), normals: loaded.value[0].normals.slice(), fields: [] as never[] }, [loaded.value]);
    const last = surfaces.length - 1;
    const same = loaded.value?.every((s) => s.positions.length === loaded.value![0].positions.length);
    useEffect(() => {
        if (!moving || !loaded.value || !same) return;
        const i = Math.min(last, Math.floor(at));
        const t = at - i;
        const a = loaded.value[i].positions;
        const b = loaded.value[Math.min(last, i + 1)].positions;
        for (let k = 0; k < a.length; k++) moving.positions[k] = a[k] + t * (b[k] - a[k]);
        normalsOf(moving);
        moved(moving);
        setVersion((v) => v + 1);
    }, [at, moving]);
    useEffect(() => {
        if (!playing) return;
        let frame = 0;
        const start = performance.now();
        const step = (now: number) => {
            const phase = ((now - start) / 2500) % 2;
            setAt(last * (phase < 1 ? phase : 2 - phase));
            frame = requestAnimationFrame(step);
        };
        frame = requestAnimationFrame(step);
        return () => cancelAnimationFrame(frame);
    }, [playing]);
    const here = Math.round(at);
    const inPicture = [...new Set(Array.from({ length: PICTURED_MAX }, (_, k) => Math.round((k * last) / (PICTURED_MAX - 1))))];
    return (
        <Shown of={loaded} label={t`shapes`}>{() => (
            <>
                <figure class="shape tall">
                    {moving && <View parts={[{ shape: moving }]} camera={linked} version={version} label={t`Shape ${texts[here]}`} />}
                    <figcaption class="row">
                        <span>{texts[here]}{energies?.[here] !== undefined ? <span class="quiet"> {t`relative energy ${figure(energies[here], 2)}`}</span> : null}</span>
                        {moving && <span class="no-report"><PictureButtons parts={[{ shape: moving }]} camera={linked} name="path" /></span>}
                    </figcaption>
                </figure>
                <div class="row no-report">
                    <button onClick={() => setPlaying(!playing)} aria-pressed={playing}>{playing ? t`Stop` : t`Play`}</button>
                    {loaded.value && <MontageButton title={t`All in one picture`} name="path" camera={linked} columns={inPicture.map((i) => texts[i])} rows={async () => [{ text: '', shapes: inPicture.map((i) => ({ ...loaded.value![i] })) }]} />}
                    <input class="grow" type="range" min={0} max={last} step={0.01} value={at} aria-label={t`Where along the path`} onInput={(e) => { setPlaying(false); setAt(+e.currentTarget.value); }} />
                </div>
                <div class="gallery">{surfaces.map((s, i) => <div key={`${s.id} ${i}`}><Linked id={s.id} title={texts[i]} resolution={24} /><a class="no-report" href={link('shapes', s.id)}>{t`Open, download`}</a></div>)}</div>
            </>
        )}</Shown>
    );
}
