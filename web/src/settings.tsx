// The token, who one is with it, and what the service is.
import { useState } from 'preact/hooks';
import * as api from './api';
import { t } from './i18n';
import { LANGUAGES, choose, language } from './language';
import { go, route } from './router';
import { caller, connection, forgetJobs, refreshJobs, useValue, whoCalls } from './state';
import { Page, Shown, plural, useLoad } from './ui';

function TokenForm() {
    const [text, setText] = useState('');
    const [keep, setKeep] = useState(true);
    const [wrong, setWrong] = useState('');
    const enter = async (event: Event) => {
        event.preventDefault();
        api.setToken(text, keep);
        forgetJobs();
        try {
            await api.get('/v1/processes');
            connection.set('up');
            await whoCalls();
            refreshJobs();
            if (route.get().path[0] === 'settings') go('#/'); // else the page that was asked for
        } catch (error) {
            setWrong((error as Error).message);
        }
    };
    return (
        <form class="card" onSubmit={enter}>
            <h2>{t`Token`}</h2>
            <p class="quiet">{t`Whoever runs the service makes one with`} <code>srnfd token add</code>.</p>
            <label>{t`Token`} <input type="password" autocomplete="off" value={text} required
                onInput={(e) => setText(e.currentTarget.value)} aria-describedby="token-wrong" /></label>
            <label class="check"><input type="checkbox" checked={keep} onChange={(e) => setKeep(e.currentTarget.checked)} />
                {t`Keep it until this tab is closed`}</label>
            <p id="token-wrong" class="wrong" role="alert">{wrong}</p>
            <button class="main">{t`Use this token`}</button>
        </form>
    );
}

/** Those to choose from: one that only tries the layout is shown to whoever has it. */
const languages = Object.entries(LANGUAGES).filter(([code]) => !code.includes('-x-') || code === language);

export function Settings() {
    const who = useValue(caller);
    const state = useValue(connection);
    const version = useLoad(() => api.get('/v1/version'), []);
    const forget = () => {
        api.setToken('', false);
        forgetJobs();
        caller.set(null);
        connection.set('token');
    };
    return (
        <Page title={t`Settings`}>
            {who && state !== 'token' ? (
                <section class="card">
                    <h2>{t`You`}</h2>
                    {who.tokens
                        ? <p>{t`${who.name}, with the role ${who.role}${who.role === 'viewer' ? t`: you may look at everything of yours, and change nothing` : ''}.`}</p>
                        : <p>{t`This service asks for no token: whoever reaches it may do everything.`}</p>}
                    {who.role === 'admin' && <p><a href="#/admin">{t`Administration: users, queue, storage`}</a></p>}
                    {api.hasToken() && <button onClick={forget}>{t`Forget the token`}</button>}
                </section>
            ) : null}
            {(state === 'token' || (who?.tokens ?? true)) && <TokenForm />}
            {languages.length > 1 && (
                <section class="card">
                    <h2>{t`Language`}</h2>
                    <select aria-label={t`Language`} value={language} onChange={(e) => { choose(e.currentTarget.value); location.reload(); }}>
                        {languages.map(([code, { name }]) => <option value={code} lang={code}>{name}</option>)}
                    </select>
                </section>
            )}
            <section class="card">
                <h2>{t`Service`}</h2>
                <Shown of={version}>{(v) => (
                    <>
                        <p>{t`srnfd ${v.version}, ${plural(v.workers, 'worker')}.`} <a href="../v1/openapi.yaml">{t`Description of the API`}</a></p>
                        <details><summary>{t`Versions of what it is made of`}</summary>
                            <dl class="pairs">{Object.entries(v.versions ?? {}).map(([name, text]) => <><dt>{name}</dt><dd>{`${text}`}</dd></>)}</dl>
                            <p class="quiet">{t`Numbers are made by: ${v.numericBuild}`}</p>
                        </details>
                        <p class="quiet"><a href="licences.txt">{t`Licences of what this page is made of`}</a></p>
                    </>
                )}</Shown>
            </section>
        </Page>
    );
}
