#include "{{ name }}.c"
#include <stdio.h>

#define MODEL {{ name }}_model
#define TOKEN "{{ token }}"
enum { N_PARAMETERS = {{ parameters | length }}, N_INPUTS = {{ inputs | length }}, N_OUTPUTS = {{ outputs | length }} };

static void glue_defaults(MODEL *m, double *v) {
    {{ name }}_defaults(m);
{% for one in settings %}
    v[{{ loop.index0 }}] = m->parameters.{{ syntax.name(one.name) }};
{% endfor %}
{% for one in starts + inputs %}
    v[{{ settings | length + loop.index0 }}] = {{ syntax.number(one.value) }};
{% endfor %}
}

static int glue_start(MODEL *m, const double *v) {
{% for one in settings %}
    m->parameters.{{ syntax.name(one.name) }} = v[{{ loop.index0 }}];
{% endfor %}
    return {{ name }}_start(m, {{ start_arguments("v[{}]", "v[{}]", parameters | length) | join(", ") }});
}

/* What is wrong, in words, and the values that were given. */
static void glue_refusal(int wrong, const double *v, char *text, size_t size) {
    size_t used = (size_t)snprintf(text, size, "%s", {{ name }}_refusal(wrong));
    (void)v;
    if (used >= size) return;
    switch (wrong) {
{% for places in named %}
{% if places %}
    case {{ loop.index }}:
        snprintf(text + used, size - used, " Given: {% for k in places %}{{ settings[k].name }} = %.6g{{ ", " if not loop.last }}{% endfor %}."{% for k in places %}, v[{{ k }}]{% endfor %});
        break;
{% endif %}
{% endfor %}
    default: break;
    }
}

static void glue_step(MODEL *m, const double *u) { {{ name }}_step(m, {% for _ in inputs %}u[{{ loop.index0 }}]{{ ", " if not loop.last }}{% endfor %}); }

static void glue_outputs(const MODEL *m, double *y) {
{% for one in outputs %}
    y[{{ loop.index0 }}] = m->{{ one.name }};
{% endfor %}
}

#include "fmi{{ fmi[0] }}.c"
