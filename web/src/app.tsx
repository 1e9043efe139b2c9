// The frame around all pages: places at the left, the page, the tray of jobs at the bottom, keys.
import { render } from 'preact';
import { useEffect, useLayoutEffect, useRef } from 'preact/hooks';
import { Home } from './home';
import { t } from './i18n';
import { begin, link, useRoute } from './router';
import type { Route } from './router';
import { Settings } from './settings';
import { connection, jobs, isActive, notice, refreshJobs, useValue, whoCalls } from './state';
import { Tray } from './tray';
import { Page, arrive, later } from './ui';

const Meshes = later(() => import('./meshes').then((m) => m.Meshes));
const MeshPage = later<{ id: string }>(() => import('./meshes').then((m) => m.MeshPage));
const Volume = later<{ id: string }>(() => import('./meshes').then((m) => m.Volume));
const Cohorts = later(() => import('./cohorts').then((m) => m.Cohorts));
const CohortPage = later<{ name: string }>(() => import('./cohorts').then((m) => m.CohortPage));
const Analyses = later(() => import('./analyses').then((m) => m.Analyses));
const Form = later<{ id: string }>(() => import('./analyses').then((m) => m.Form));
const Jobs = later(() => import('./jobs').then((m) => m.Jobs));
const JobPage = later<{ id: string }>(() => import('./jobs').then((m) => m.JobPage));
const ModelPage = later<{ id: string }>(() => import('./results').then((m) => m.ModelPage));
const Surfaces = later(() => import('./shapes').then((m) => m.Surfaces));
const Admin = later(() => import('./admin').then((m) => m.Admin));
const SurfacePage = later<{ id: string }>(() => import('./shapes').then((m) => m.SurfacePage));

const PLACES: [path: string, title: string, key: string][] = [
    ['', t`Home`, 'h'], ['meshes', t`Meshes`, 'm'], ['cohorts', t`Cohorts`, 'c'], ['analyses', t`Analyses`, 'a'],
    ['shapes', t`Shapes`, 's'], ['jobs', t`Jobs`, 'j'], ['settings', t`Settings`, 't'],
];

const PAGES: Record<string, (id: string | undefined) => preact.JSX.Element> = {
    '': () => <Home />,
    meshes: (id) => (id ? <MeshPage id={id} key={id} /> : <Meshes />),
    volumes: (id) => <Volume id={id ?? ''} key={id} />,
    cohorts: (id) => (id ? <CohortPage name={id} key={id} /> : <Cohorts />),
    analyses: (id) => (id ? <Form id={id} key={id} /> : <Analyses />),
    shapes: (id) => (id ? <SurfacePage id={id} key={id} /> : <Surfaces />),
    models: (id) => <ModelPage id={id ?? ''} key={id} />,
    jobs: (id) => (id ? <JobPage id={id} key={id} /> : <Jobs />),
    settings: () => <Settings />,
    admin: () => <Admin />,
};

function Content({ route }: { route: Route }) {
    const page = PAGES[route.path[0] ?? ''];
    if (page) return page(route.path[1]);
    return <Page title={t`Nothing here`}><p>{t`There is no page of this address.`} <a href="#/">{t`Back to the start`}</a></p></Page>;
}

const KEYS: [string, string][] = [
    [t`g, then h m c a s j t`, t`go to a place`], ['/', 'search'], ['?', t`this list`],
    ['arrows', t`turn the shape that has the focus`], ['+ and -', t`nearer, farther`], ['0', t`the first view`],
    ['1 to 6', t`views from the six sides`], ['L', t`link or part the views`],
    [t`Space`, t`play, or choose`], [t`Esc`, 'close'],
];

function Help({ opened }: { opened: { current: HTMLDialogElement | null } }) {
    return (
        <dialog ref={opened} aria-label={t`Keys`}>
            <h2>{t`Keys`}</h2>
            <dl class="keys">{KEYS.map(([key, what]) => <><dt><kbd>{key}</kbd></dt><dd>{what}</dd></>)}</dl>
            <button onClick={() => opened.current?.close()}>{t`Close`}</button>
        </dialog>
    );
}

function useKeys(help: { current: HTMLDialogElement | null }): void {
    // Keys count from when the page is there, not from a frame later.
    useLayoutEffect(() => {
        let gone = 0;
        const pressed = (event: KeyboardEvent) => {
            const at = event.target as HTMLElement;
            if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|TEXTAREA|SELECT)$/.test(at.tagName)) return;
            const place = PLACES.find(([, , key]) => key === event.key);
            if (Date.now() - gone < 1500 && place) {
                location.hash = `/${place[0]}`;
                event.preventDefault();
            } else if (event.key === '?') help.current?.showModal();
            else if (event.key === '/') {
                const search = document.querySelector<HTMLElement>('input[type=search]');
                if (search) {
                    search.focus();
                    event.preventDefault();
                }
            }
            gone = event.key === 'g' ? Date.now() : 0;
        };
        addEventListener('keydown', pressed);
        return () => removeEventListener('keydown', pressed);
    }, []);
}

function Banner() {
    const state = useValue(connection);
    if (state === 'up') return null;
    return (
        <div class="banner" role="alert">
            {state === 'down' ? t`The service does not answer. What you see may be old; the page goes on when it answers again.`
                : <>{t`This service asks for a token.`} <a href="#/settings">{t`Enter it`}</a></>}
        </div>
    );
}

function App() {
    const route = useRoute();
    const help = useRef<HTMLDialogElement>(null);
    const said = useValue(notice);
    const running = useValue(jobs).filter(isActive).length;
    const token = useValue(connection) === 'token';
    const first = useRef(true);
    useKeys(help);
    const address = route.path.join('/');
    useEffect(() => {
        if (!first.current) arrive();
        begin();
        first.current = false;
    }, [address]);
    const here = { volumes: 'meshes', models: 'analyses', admin: 'settings' }[route.path[0]] ?? route.path[0] ?? '';
    return (
        <div class="frame">
            <a class="skip" href="#main" onClick={(e) => { e.preventDefault(); document.querySelector<HTMLElement>('main h1')?.focus(); }}>{t`Skip to the page`}</a>
            <nav aria-label={t`Places`}>
                <a class="brand" href="#/">srnfd</a>
                <ul>{PLACES.map(([path, title]) => (
                    <li key={path}>
                        <a href={path ? link(path) : '#/'} aria-current={here === path ? 'page' : undefined}>
                            {title}{path === 'jobs' && running > 0 ? <span class="count" aria-label={t`${running} active`}>{running}</span> : null}
                        </a>
                    </li>
                ))}</ul>
                <button class="plain-button" onClick={() => help.current?.showModal()}>{t`Keys`} <kbd>?</kbd></button>
            </nav>
            <main id="main">
                <Banner />
                {token && route.path[0] !== 'settings' ? <Settings /> : <Content route={route} />}
            </main>
            <Tray />
            <Help opened={help} />
            <div class="sr" role="status" aria-live="polite">{said}</div>
        </div>
    );
}

render(<App />, document.getElementById('app')!);
void whoCalls();
refreshJobs();
