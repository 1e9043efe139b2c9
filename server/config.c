/*
 * config.c - settings from one table: each has a member name in the JSON file, an environment
 * variable, an option, and a range. An unknown member or option, a value of the wrong type and one
 * out of range are errors: a setting that is passed over in silence is worse than a daemon that
 * does not start.
 */
#include "config.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum kind { KIND_TEXT, KIND_CHOICE, KIND_NUMBER, KIND_FLAG };

/* What each KIND_CHOICE may say. */
static const char *const access_logs[] = {"all", "requests", "refusals", NULL};
static const char *const executors[] = {"local", "workers", "slurm", NULL};

static const struct setting {
    enum kind kind;
    size_t offset;
    double least, most; /* of a text: characters, where it may be longer than others */
    bool whole;
} settings[] = {
    {KIND_TEXT, offsetof(struct config, listen), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, data), 0, 0, false},
    {KIND_NUMBER, offsetof(struct config, workers), 0, 256, true},
    {KIND_CHOICE, offsetof(struct config, executor), 0, 0, false},
    {KIND_NUMBER, offsetof(struct config, lease_seconds), 1, 3600, false},
    {KIND_NUMBER, offsetof(struct config, task_seconds), 1, 1e6, false},
    {KIND_NUMBER, offsetof(struct config, verify_tasks), 0, 1, false},
    {KIND_TEXT, offsetof(struct config, slurm_partition), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, slurm_account), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, slurm_qos), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, slurm_time), 0, 0, false},
    {KIND_NUMBER, offsetof(struct config, slurm_cpus), 1, 256, true},
    {KIND_NUMBER, offsetof(struct config, slurm_memory), 0, 16777216, true},
    {KIND_NUMBER, offsetof(struct config, slurm_workers), 1, 1000, true},
    {KIND_TEXT, offsetof(struct config, slurm_arguments), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, slurm_server), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, slurm_program), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, slurm_cache), 0, 0, false},
    {KIND_NUMBER, offsetof(struct config, slurm_seconds), 0.1, 120, false},
    {KIND_NUMBER, offsetof(struct config, slurm_poll_seconds), 0.1, 300, false},
    {KIND_NUMBER, offsetof(struct config, http_threads), 0, 16, true},
    {KIND_NUMBER, offsetof(struct config, request_threads), 1, 32, true},
    {KIND_NUMBER, offsetof(struct config, upload_threads), 1, 32, true},
    {KIND_NUMBER, offsetof(struct config, upload_memory), 0, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, max_connections), 1, 100000, true},
    {KIND_NUMBER, offsetof(struct config, kept_connections), 0, 100000, true},
    {KIND_NUMBER, offsetof(struct config, max_owner_requests), 0, 100000, true},
    {KIND_NUMBER, offsetof(struct config, max_waiting), 1, 1000000, true},
    {KIND_NUMBER, offsetof(struct config, max_streams), 1, 100000, true},
    {KIND_NUMBER, offsetof(struct config, header_seconds), 0.1, 3600, false},
    {KIND_NUMBER, offsetof(struct config, transfer_seconds), 0.1, 3600, false},
    {KIND_NUMBER, offsetof(struct config, idle_seconds), 0.1, 3600, false},
    {KIND_NUMBER, offsetof(struct config, max_body), 1024, 1073741824.0, true},
    {KIND_NUMBER, offsetof(struct config, max_buffered), 1024, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, max_owner_buffered), 0, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, max_peer_buffered), 0, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, max_owner_exports), 1024, 1e15, true},
    {KIND_NUMBER, offsetof(struct config, least_rate), 1, 1e9, true},
    {KIND_NUMBER, offsetof(struct config, max_queued), 1, 10000000, true},
    {KIND_NUMBER, offsetof(struct config, sync_wait_seconds), 0.001, 300, false},
    {KIND_NUMBER, offsetof(struct config, grace_seconds), 0, 3600, false},
    {KIND_NUMBER, offsetof(struct config, job_seconds), 0, 31536000, false},
    {KIND_NUMBER, offsetof(struct config, job_memory), 0, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, job_cache), 0, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, kept_encodings), 0, 1099511627776.0, true},
    {KIND_NUMBER, offsetof(struct config, kept_meshes), 0, 1e15, true},
    {KIND_NUMBER, offsetof(struct config, retention_days), 0, 36500, false},
    {KIND_NUMBER, offsetof(struct config, sweep_seconds), 0.1, 86400, false},
    {KIND_TEXT, offsetof(struct config, allowed_hosts), 0, 0, false},
    {KIND_CHOICE, offsetof(struct config, access_log), 0, 0, false},
    {KIND_NUMBER, offsetof(struct config, least_free), 0, 1e15, true},
    {KIND_FLAG, offsetof(struct config, insecure), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, cors_origins), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, tls_certificate), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, tls_key), 0, 0, false},
    {KIND_TEXT, offsetof(struct config, link_prefixes), 1, CONFIG_LIST_MAX - 1, false},
    {KIND_TEXT, offsetof(struct config, link_networks), 1, CONFIG_LIST_MAX - 1, false},
    {KIND_NUMBER, offsetof(struct config, link_seconds), 0.1, 600, false},
    {KIND_NUMBER, offsetof(struct config, quota_queued), 0, 10000000, true},
    {KIND_NUMBER, offsetof(struct config, quota_running), 0, 256, true},
    {KIND_NUMBER, offsetof(struct config, quota_bytes), 0, 9007199254740992.0, true},
    {KIND_NUMBER, offsetof(struct config, quota_requests), 0, 1000000, true},
    {KIND_NUMBER, offsetof(struct config, quota_streams), 0, 100000, true},
};
#define N_SETTINGS (sizeof settings / sizeof settings[0])

static const struct config_help names[N_SETTINGS] = {
    {"listen", "SRNFD_LISTEN", "--listen",
     "address and port, 127.0.0.1:8080; port 0 takes a free one"},
    {"data", "SRNFD_DATA", "--data", "the data directory, ./data"},
    {"workers", "SRNFD_WORKERS", "--workers",
     "worker threads; 0, the default, is one per processor"},
    {"executor", "SRNFD_EXECUTOR", "--executor",
     "local, the default: worker threads compute all of a job; workers: they offer what they can "
     "as tasks to the processes of srnfd worker; slurm: so, and a cluster is asked for these"},
    {"leaseSeconds", "SRNFD_LEASE_SECONDS", "--lease-seconds",
     "without a sign of the worker, after which its task goes to another, 15"},
    {"taskSeconds", "SRNFD_TASK_SECONDS", "--task-seconds",
     "without a result of the worker, whatever signs it gives, after which its task goes to "
     "another, 600"},
    {"verifyTasks", "SRNFD_VERIFY_TASKS", "--verify-tasks",
     "share of what workers return that the daemon computes again and compares, from 0 to 1, 0.02"},
    {"slurmPartition", "SRNFD_SLURM_PARTITION", "--slurm-partition",
     "of the workers that Slurm is asked for; the cluster's default, like account, qos and time"},
    {"slurmAccount", "SRNFD_SLURM_ACCOUNT", "--slurm-account", "that they are charged to"},
    {"slurmQos", "SRNFD_SLURM_QOS", "--slurm-qos", "their quality of service"},
    {"slurmTime", "SRNFD_SLURM_TIME", "--slurm-time", "their time limit, as in 2:00:00 or 1-0"},
    {"slurmCpus", "SRNFD_SLURM_CPUS", "--slurm-cpus", "processors of each, and tasks at once, 1"},
    {"slurmMemory", "SRNFD_SLURM_MEMORY", "--slurm-memory",
     "MiB of each; 0, the default: as the cluster gives. One that runs out of it is followed by "
     "ones with twice as much"},
    {"slurmWorkers", "SRNFD_SLURM_WORKERS", "--slurm-workers", "of them at once, at most, 16"},
    {"slurmArguments", "SRNFD_SLURM_ARGUMENTS", "--slurm-arguments",
     "more for sbatch, separated by blanks, each as --option or --option=value; none"},
    {"slurmServer", "SRNFD_SLURM_SERVER", "--slurm-server",
     "URL under which the nodes reach the service; by default where it listens"},
    {"slurmProgram", "SRNFD_SLURM_PROGRAM", "--slurm-program",
     "srnfd on the nodes; by default the path of this one"},
    {"slurmCache", "SRNFD_SLURM_CACHE", "--slurm-cache",
     "folder on the nodes for what tasks are about; none"},
    {"slurmSeconds", "SRNFD_SLURM_SECONDS", "--slurm-seconds",
     "that sbatch, squeue or scancel may take, 15"},
    {"slurmPollSeconds", "SRNFD_SLURM_POLL_SECONDS", "--slurm-poll-seconds",
     "between two questions to squeue, 3"},
    {"httpThreads", "SRNFD_HTTP_THREADS", "--http-threads",
     "threads of the HTTP library; 0, the default, is one for two processors, 1 to 4"},
    {"requestThreads", "SRNFD_REQUEST_THREADS", "--request-threads",
     "threads for slow requests, 4"},
    {"uploadThreads", "SRNFD_UPLOAD_THREADS", "--upload-threads",
     "threads that parse bodies: meshes, surfaces, and JSON of more than 64 KiB, 2"},
    {"uploadMemory", "SRNFD_UPLOAD_MEMORY", "--upload-memory",
     "bytes that they may have in use together; 0, the default, is an eighth of the memory, and at "
     "least 384 MiB"},
    {"maxConnections", "SRNFD_MAX_CONNECTIONS", "--max-connections",
     "with a request; beyond them those that are idle give way, or 503 is answered, 1024"},
    {"keptConnections", "SRNFD_KEPT_CONNECTIONS", "--kept-connections",
     "of them, only for callers whose token was seen; 0, the default, is an eighth"},
    {"maxOwnerRequests", "SRNFD_MAX_OWNER_REQUESTS", "--max-owner-requests",
     "requests of a token's owner in progress at once; 0, the default, is a quarter of the "
     "connections"},
    {"maxWaiting", "SRNFD_MAX_WAITING", "--max-waiting",
     "connections that have sent no request; beyond them the oldest goes, 4096"},
    {"maxStreams", "SRNFD_MAX_STREAMS", "--max-streams", "streams of events at once, 128"},
    {"headerSeconds", "SRNFD_HEADER_SECONDS", "--header-seconds",
     "from connecting to the end of a request's head, 15"},
    {"transferSeconds", "SRNFD_TRANSFER_SECONDS", "--transfer-seconds",
     "a body or a response that falls behind --least-rate for so long is cut off, 30"},
    {"idleSeconds", "SRNFD_IDLE_SECONDS", "--idle-seconds",
     "between two requests of a connection, 60"},
    {"maxBody", "SRNFD_MAX_BODY", "--max-body", "bytes of a request's body, 268435456"},
    {"maxBuffered", "SRNFD_MAX_BUFFERED", "--max-buffered",
     "bytes of all bodies and large responses at once, 1073741824"},
    {"maxOwnerBuffered", "SRNFD_MAX_OWNER_BUFFERED", "--max-owner-buffered",
     "of them, those of a token's owner; 0, the default, is a quarter"},
    {"maxPeerBuffered", "SRNFD_MAX_PEER_BUFFERED", "--max-peer-buffered",
     "of them, those of an address that is not of this machine; 0, the default, is half"},
    {"maxOwnerExports", "SRNFD_MAX_OWNER_EXPORTS", "--max-owner-exports",
     "bytes on the disk of exports of a token's owner that are written and sent at once, or of an "
     "address that is not of this machine; one export may be larger, 1073741824"},
    {"leastRate", "SRNFD_LEAST_RATE", "--least-rate",
     "bytes a second that a body or a response must move, 16384"},
    {"maxQueued", "SRNFD_MAX_QUEUED", "--max-queued", "jobs that may wait, 10000"},
    {"syncWaitSeconds", "SRNFD_SYNC_WAIT_SECONDS", "--sync-wait-seconds",
     "how long an execution without Prefer waits, 30"},
    {"graceSeconds", "SRNFD_GRACE_SECONDS", "--grace-seconds",
     "what SIGTERM gives requests and jobs to end, 20"},
    {"jobSeconds", "SRNFD_JOB_SECONDS", "--job-seconds",
     "a job that runs longer fails with time-limit; 0, the default, sets no limit"},
    {"jobMemory", "SRNFD_JOB_MEMORY", "--job-memory",
     "bytes that a job may have in use, beyond them it fails with memory-limit; 0, the default, is "
     "three quarters of the memory divided by the workers and two more"},
    {"jobCache", "SRNFD_JOB_CACHE", "--job-cache",
     "bytes that a mean of a large group holds in memory of the warps of its members, beyond them "
     "it has a file in the data directory; 0, the default, is an eighth of jobMemory, 134217728 at "
     "most"},
    {"keptEncodings", "SRNFD_KEPT_ENCODINGS", "--kept-encodings",
     "bytes of encodings that are kept for later jobs, 268435456; 0: none are"},
    {"keptMeshes", "SRNFD_KEPT_MESHES", "--kept-meshes",
     "bytes of prepared meshes that are kept for later jobs, 1073741824; 0: none are"},
    {"retentionDays", "SRNFD_RETENTION_DAYS", "--retention-days",
     "ended jobs are removed after so many days; 0, the default, keeps them"},
    {"sweepSeconds", "SRNFD_SWEEP_SECONDS", "--sweep-seconds",
     "between two looks for jobs and files that may go, 3600"},
    {"allowedHosts", "SRNFD_ALLOWED_HOSTS", "--allowed-hosts",
     "what Host may name beside loopback, separated by commas; none"},
    {"accessLog", "SRNFD_ACCESS_LOG", "--access-log",
     "refusals: a line in the log for each request that is refused; requests, the default: for "
     "each but successful probes of /healthz, /readyz and /metrics; all: for these too"},
    {"leastFree", "SRNFD_LEAST_FREE", "--least-free",
     "bytes that must be free on the disk for /readyz to say so; prepared meshes give way for "
     "them, 67108864"},
    {"insecure", "SRNFD_INSECURE", "--insecure", "answer callers from elsewhere without tokens"},
    {"corsOrigins", "SRNFD_CORS_ORIGINS", "--cors-origins",
     "origins whose pages may call, separated by commas; none"},
    {"tlsCertificate", "SRNFD_TLS_CERTIFICATE", "--tls-certificate",
     "PEM file of the certificate and its chain: serve HTTPS"},
    {"tlsKey", "SRNFD_TLS_KEY", "--tls-key",
     "PEM file of its key; both are read anew when replaced"},
    {"linkPrefixes", "SRNFD_LINK_PREFIXES", "--link-prefixes",
     "addresses, separated by commas, under which links in inputs may name content of other "
     "servers, as https://data.example.org/meshes/, up to 4095 characters; none"},
    {"linkNetworks", "SRNFD_LINK_NETWORKS", "--link-networks",
     "addresses and networks beside public ones, as 10.1.0.0/16, to which such links may lead, up "
     "to 4095 characters; none"},
    {"linkSeconds", "SRNFD_LINK_SECONDS", "--link-seconds",
     "that fetching all links of a request may take, 30"},
    {"quotaQueued", "SRNFD_QUOTA_QUEUED", "--quota-queued",
     "jobs of a token's owner that may wait; 0: any number; 1000"},
    {"quotaRunning", "SRNFD_QUOTA_RUNNING", "--quota-running",
     "jobs of a token's owner that may run at once, 0"},
    {"quotaBytes", "SRNFD_QUOTA_BYTES", "--quota-bytes",
     "bytes that a token's owner may hold, 10737418240"},
    {"quotaRequests", "SRNFD_QUOTA_REQUESTS", "--quota-requests",
     "requests a second of a token, 100"},
    {"quotaStreams", "SRNFD_QUOTA_STREAMS", "--quota-streams",
     "answers of a token that may wait for jobs at once, 32"},
};

static const struct config defaults = {
    .listen = "127.0.0.1:8080",
    .data = "data",
    .workers = 0,
    .executor = "local",
    .lease_seconds = 15,
    .task_seconds = 600,
    .verify_tasks = 0.02,
    .slurm_cpus = 1,
    .slurm_workers = 16,
    .slurm_seconds = 15,
    .slurm_poll_seconds = 3,
    .request_threads = 4,
    .upload_threads = 2,
    .max_connections = 1024,
    .max_waiting = 4096,
    .max_streams = 128,
    .header_seconds = 15,
    .transfer_seconds = 30,
    .idle_seconds = 60,
    .max_body = 268435456,
    .max_buffered = 1073741824,
    .max_owner_exports = 1073741824,
    .least_rate = 16384,
    .max_queued = 10000,
    .sync_wait_seconds = 30,
    .grace_seconds = 20,
    .job_seconds = 0,
    .job_memory = 0,
    .job_cache = 0,
    .kept_encodings = 268435456,
    .kept_meshes = 1073741824,
    .retention_days = 0,
    .sweep_seconds = 3600,
    .allowed_hosts = "",
    .access_log = "requests",
    .least_free = 67108864,
    .insecure = false,
    .cors_origins = "",
    .tls_certificate = "",
    .tls_key = "",
    .link_prefixes = "",
    .link_networks = "",
    .link_seconds = 30,
    .quota_queued = 1000,
    .quota_running = 0,
    .quota_bytes = 10737418240.0,
    .quota_requests = 100,
    .quota_streams = 32,
};

size_t config_table(const struct config_help **table)
{
    *table = names;
    return N_SETTINGS;
}

static int fail(char *message, size_t size, const char *source, const char *detail)
{
    (void)snprintf(message, size, "%s: %s", source, detail);
    return -1;
}

static int set_number(struct config *config, size_t i, double value, const char *source,
                      char *message, size_t size)
{
    const struct setting *setting = &settings[i];

    if (!(value >= setting->least && value <= setting->most) ||
        (setting->whole && value != floor(value))) {
        (void)snprintf(message, size, "%s must be %s from %.12g to %.12g", source,
                       setting->whole ? "a whole number" : "a number", setting->least,
                       setting->most);
        return -1;
    }
    memcpy((char *)config + setting->offset, &value, sizeof value);
    return 0;
}

static const char *const *choices_of(size_t i)
{
    return settings[i].offset == offsetof(struct config, executor) ? executors : access_logs;
}

static bool is_choice(size_t i, const char *value)
{
    const char *const *choice = choices_of(i);

    while (*choice && strcmp(*choice, value) != 0) {
        choice++;
    }
    return *choice != NULL;
}

/* What a setting must be: "local or workers". */
static int fail_choice(size_t i, const char *source, char *message, size_t size)
{
    const char *const *choice = choices_of(i);
    size_t used = (size_t)snprintf(message, size, "%s must be %s", source, *choice);

    while (*++choice && used < size) {
        used += (size_t)snprintf(message + used, size - used, "%s%s", choice[1] ? ", " : " or ",
                                 *choice);
    }
    return -1;
}

static int set_text(struct config *config, size_t i, const char *value, const char *source,
                    char *message, size_t size)
{
    size_t most = settings[i].most > 0 ? (size_t)settings[i].most : CONFIG_TEXT_MAX - 1;

    if (settings[i].kind == KIND_CHOICE && !is_choice(i, value)) {
        return fail_choice(i, source, message, size);
    }
    if (!value[0] || strlen(value) > most) {
        (void)snprintf(message, size, "%s: must have 1 to %zu characters", source, most);
        return -1;
    }
    memcpy((char *)config + settings[i].offset, value, strlen(value) + 1);
    return 0;
}

static void set_flag(struct config *config, size_t i, bool value)
{
    memcpy((char *)config + settings[i].offset, &value, sizeof value);
}

/* A value that came as text, from the environment or the command line. */
static int set_from_text(struct config *config, size_t i, const char *value, const char *source,
                         char *message, size_t size)
{
    char *end;
    double number;

    if (settings[i].kind == KIND_TEXT || settings[i].kind == KIND_CHOICE) {
        return set_text(config, i, value, source, message, size);
    }
    if (settings[i].kind == KIND_FLAG) {
        if (strcmp(value, "0") != 0 && strcmp(value, "1") != 0) {
            return fail(message, size, source, "must be 0 or 1");
        }
        set_flag(config, i, value[0] == '1');
        return 0;
    }
    number = strtod(value, &end);
    if (end == value || *end) {
        return fail(message, size, source, "must be a number");
    }
    return set_number(config, i, number, source, message, size);
}

static int set_from_json(struct config *config, const char *member, const json_t *value,
                         char *message, size_t size)
{
    for (size_t i = 0; i < N_SETTINGS; i++) {
        if (strcmp(names[i].member, member) != 0) {
            continue;
        }
        if ((settings[i].kind == KIND_TEXT || settings[i].kind == KIND_CHOICE) &&
            json_is_string(value)) {
            return set_text(config, i, json_string_value(value), member, message, size);
        }
        if (settings[i].kind == KIND_NUMBER && json_is_number(value)) {
            return set_number(config, i, json_number_value(value), member, message, size);
        }
        if (settings[i].kind == KIND_FLAG && json_is_boolean(value)) {
            set_flag(config, i, json_is_true(value));
            return 0;
        }
        return fail(message, size, member, "has the wrong type");
    }
    return fail(message, size, member, "is no known setting");
}

static int load_file(struct config *config, const char *path, char *message, size_t size)
{
    json_error_t error;
    json_t *document = json_load_file(path, JSON_REJECT_DUPLICATES, &error), *value;
    const char *member;
    int status = 0;

    if (!json_is_object(document)) {
        json_decref(document);
        return fail(message, size, path, document ? "must be a JSON object" : error.text);
    }
    json_object_foreach(document, member, value)
    {
        status = set_from_json(config, member, value, message, size);
        if (status != 0) {
            break;
        }
    }
    json_decref(document);
    return status;
}

static int load_environment(struct config *config, char *message, size_t size)
{
    for (size_t i = 0; i < N_SETTINGS; i++) {
        const char *value = getenv(names[i].environment);

        if (value && set_from_text(config, i, value, names[i].environment, message, size) != 0) {
            return -1;
        }
    }
    return 0;
}

/* The value of --option or --option=value at arguments[*at]; NULL where it is another option. */
static const char *option_value(const char *option, int n_arguments, char *const *arguments,
                                int *at)
{
    size_t length = strlen(option);
    const char *argument = arguments[*at];

    if (strncmp(argument, option, length) != 0) {
        return NULL;
    }
    if (argument[length] == '=') {
        return argument + length + 1;
    }
    if (argument[length] != '\0') {
        return NULL;
    }
    return *at + 1 < n_arguments ? arguments[++*at] : "";
}

static int load_arguments(struct config *config, int n_arguments, char *const *arguments,
                          char *message, size_t size)
{
    for (int at = 0; at < n_arguments; at++) {
        const char *value = option_value("--config", n_arguments, arguments, &at);
        const char *name = arguments[at];
        int status = value ? 0 : 1;

        for (size_t i = 0; i < N_SETTINGS && status == 1; i++) {
            if (settings[i].kind == KIND_FLAG && strcmp(name, names[i].option) == 0) {
                set_flag(config, i, true);
                status = 0;
                break;
            }
            value = option_value(names[i].option, n_arguments, arguments, &at);
            if (value) {
                status = set_from_text(config, i, value, names[i].option, message, size);
            }
        }
        if (status == 1) {
            return fail(message, size, name, "is no known option; see srnfd help");
        }
        if (status != 0) {
            return status;
        }
    }
    return 0;
}

/* What a service manager hands over (systemd's LoadCredential): a certificate and its key, where
   the folder has them. */
static void take_credentials(struct config *config)
{
    const char *folder = getenv("CREDENTIALS_DIRECTORY");
    char path[CONFIG_TEXT_MAX];

    if (!folder || strlen(folder) + sizeof "/tls-certificate" > sizeof path) {
        return;
    }
    (void)snprintf(path, sizeof path, "%s/tls-certificate", folder);
    if (access(path, F_OK) == 0) {
        memcpy(config->tls_certificate, path, sizeof path);
    }
    (void)snprintf(path, sizeof path, "%s/tls-key", folder);
    if (access(path, F_OK) == 0) {
        memcpy(config->tls_key, path, sizeof path);
    }
}

int config_load(struct config *config, int n_arguments, char *const *arguments, char *message,
                size_t size)
{
    const char *file = getenv("SRNFD_CONFIG");

    *config = defaults;
    take_credentials(config);
    for (int at = 0; at < n_arguments; at++) {
        const char *value = option_value("--config", n_arguments, arguments, &at);

        file = value ? value : file;
    }
    if (file && load_file(config, file, message, size) != 0) {
        return -1;
    }
    if (load_environment(config, message, size) != 0) {
        return -1;
    }
    return load_arguments(config, n_arguments, arguments, message, size);
}
