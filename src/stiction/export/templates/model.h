{% import "functions.c" as c with context %}
/* {{ written_by | join("\n   ") | comment }} */
#ifndef {{ name | upper }}_H
#define {{ name | upper }}_H

#ifdef __cplusplus
extern "C" {
#endif

/* Parameters of {{ name }}. */
typedef struct {
{% for one in settings %}
    double {{ syntax.name(one.name) }}; /* {{ one | meaning | comment }} */
{% else %}
    double unused;
{% endfor %}
} {{ name }}_parameters;

{% for struct in in_header %}
{{ c.typedef(struct) }}
{% endfor %}
/* One {{ name }}: its parameters, its state and its outputs. */
typedef struct {
    double dt; /* Sampling period [s] */
    {{ name }}_parameters parameters;
{% for one in packed %}
    double {{ one.name }}[{{ one.length }}];
{% endfor %}
    {{ syntax.type_name(state) }} state;
{% for array, length in arrays %}
    double {{ array }}[{{ length }}];
{% endfor %}
{% for one in outputs %}
    double {{ one.name }}; /* {{ one | meaning | comment }} */
{% endfor %}
} {{ name }}_model;

/* Set the parameters and the sampling period of the export. */
void {{ name }}_defaults({{ name }}_model *m);

/* Compute what depends on the parameters and come to rest. Returns 0, or the number of what is wrong. */
int {{ name }}_start({{ name }}_model *m, {{ c.arguments(start_names) }});

/* What is wrong, in words. */
const char *{{ name }}_refusal(int number);

/* One sample: read the inputs, set the outputs. */
void {{ name }}_step({{ name }}_model *m, {{ c.arguments(inputs | map(attribute="name")) }});

#define {{ name | upper }}_MEMORY (sizeof({{ name }}_model) / sizeof(double))

/* The same without a record of its own: `memory` holds the model between two calls, `first` is 1 at the
   start, `parameters` and `inputs` are in the order of the header; after the parameters of the model come
   {{ starts | length }} for the start only. Returns 0, or the number of what is wrong. */
int {{ name }}_sample(int first, double dt, const double *parameters, const double *inputs,
    const double *before,
    double *memory, double *outputs);

#ifdef __cplusplus
}
#endif
#endif
