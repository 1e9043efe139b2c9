# Who may include whom, over any number of C files below the project's root:
#
#   awk -f layers.awk include/.. core/.. server/..
#
# prints "file:line: what" for every #include that goes against the layers:
#
#   server/  main (main.c and commands.c) -> slurm -> worker -> processes -> toolkit -> http -> api -> compute ->
#            jobs -> store -> tasks. A layer includes its own headers, those of the layers after it, srnf.h, and what lies directly in
#            server/ (embedded.h, ..), which in turn includes no layer's header; processes and toolkit pass
#            http over. Each library has its home: libmicrohttpd in http, jansson in api, worker and the two
#            between them, SQLite and utf8proc in store, libarchive in api, libcurl in api and worker; only what
#            lies directly in server/ may name them
#            too, as it tells their versions.
#   core/    harmonics -> linear -> mesh -> formats -> volume -> sphere_map -> srnf -> surface -> inversion ->
#            registration -> geodesic -> pullback -> stats. A folder includes its own headers, those of the
#            folders before it, srnf.h and internal.h; never a header of server/, and no system header for
#            files, processes, threads or clocks.
#   include/ the public headers include each other, and of the system's those that core/ may.

BEGIN {
    number_of("main slurm worker processes toolkit http api compute jobs store tasks", layer)
    number_of("harmonics linear mesh formats volume sphere_map srnf surface inversion registration geodesic pullback stats", \
              stage)
    home["microhttpd.h"] = "http"
    home["gnutls/gnutls.h"] = home["gnutls/abstract.h"] = "http"
    home["jansson.h"] = "api toolkit processes worker"
    home["sqlite3.h"] = "store"
    home["utf8proc.h"] = "store"
    home["curl/curl.h"] = "api worker"
    home["archive.h"] = home["archive_entry.h"] = "api"
    n = split("microhttpd.h jansson.h sqlite3.h sodium.h pthread.h threads.h time.h signal.h unistd.h " \
              "fcntl.h dirent.h syslog.h omp.h", list, " ")
    for (i = 1; i <= n; i++) impure[list[i]] = 1
}

function number_of(names, table,    list, n, i) {
    n = split(names, list, " ")
    for (i = 1; i <= n; i++) table[list[i]] = i
}

function exists(path,    line, found) {
    found = (getline line < path) >= 0
    close(path)
    return found
}

function violation(what) {
    printf "%s:%d: %s\n", FILENAME, FNR, what
}

function check_server(header,    parts) {
    if (header == "srnf.h") return
    if (header ~ /\//) {
        split(header, parts, "/")
        if (!(parts[1] in layer))
            violation("\"" header "\" is no header of a layer")
        else if (place == "common")
            violation("\"" header "\" is of a layer, and this file belongs to none")
        else if (layer[parts[1]] < layer[place] || parts[1] == "http" && place ~ /^(processes|toolkit)$/)
            violation(place " includes \"" header "\", which is of a layer before it")
    } else if (!exists(folder "/" header) && !exists("server/" header)) {
        violation("\"" header "\" is neither in its own folder nor in server/")
    }
}

function check_core(header,    parts) {
    if (header == "srnf.h" || header == "internal.h") return
    if (header ~ /\//) {
        split(header, parts, "/")
        if (!(parts[1] in stage))
            violation("\"" header "\" is no header of core/")
        else if (!(place in stage) || stage[parts[1]] > stage[place])
            violation(place " includes \"" header "\", which comes after it in the flow of data")
    } else if (!exists(folder "/" header)) {
        violation("\"" header "\" is not in its own folder")
    }
}

FNR == 1 {
    n = split(FILENAME, path, "/")
    top = path[1]
    if (n > 2) place = path[2]
    else if (top == "core") place = "the root of core/"
    else place = path[2] ~ /^(main|commands)\.[ch]$/ ? "main" : "common"
    folder = FILENAME
    sub(/\/[^\/]*$/, "", folder)
    if (top == "server" && place != "common" && !(place in layer))
        violation("server/" place " is no layer")
    if (top == "core" && n > 2 && !(place in stage)) violation("core/" place " is no stage")
}

/^[ \t]*#[ \t]*include[ \t]*"/ {
    split($0, quoted, "\"")
    if (quoted[2] ~ /\.\./) violation("\"" quoted[2] "\" goes up")
    else if (top == "server") check_server(quoted[2])
    else if (top == "core") check_core(quoted[2])
    else if (top == "include" && !exists("include/" quoted[2]))
        violation("\"" quoted[2] "\" is no public header")
}

/^[ \t]*#[ \t]*include[ \t]*</ {
    header = $0
    gsub(/^[^<]*<|>.*$/, "", header)
    if (top == "server" && header in home && place in layer && place != "main" &&
        (" " home[header] " ") !~ (" " place " "))
        violation("<" header "> belongs to server/" home[header])
    if ((top == "core" || top == "include") && (header in impure || header ~ /^sys\//))
        violation("<" header "> has no place in " top "/")
}
