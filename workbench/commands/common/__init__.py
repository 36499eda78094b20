"""What commands share.

options     arguments of every command, and a study that leaves a run folder
run_folder, stage_file, new_folder    that folder: resumable stages, then renamed; a folder of files made at once
outcome, drawing    what a study leaves behind; its report, drawn when all numbers are written
head, design_numbers    what every report says of its rig, controllers and command, and their numbers
run_index   index.html: the finished runs of a folder
metric_table, loop_margins    rows of metrics as tables of a report, and margins of loops
declared            experiments as classes of fields: file, options and reference are made of them
experiment_file     the document of an experiment file, and the names that its keys had before
experiment, step_experiment, bench_experiment, record_experiment    experiments that several commands read
drawn_record, plant_ranges    records on drawn plants; what those were drawn over
envelope_keys       what a loop has to hold on: positions, drawn plants, limits of the goals
designs, rig_out, columns    commands that print of each controller; that leave a rig; text in columns
sines, error_page, time_figure    sweeps, errors and runs as several reports show them
sessions, session_tables    groups of records that differ in a number of the rig; their own numbers in a report
scenario_tables, profiles, rig_sets    scenarios of an experiment and rigs of its set, standard ones and its own
platform_scene      a platform drawn as lines in space
platform_experiment, platform_motion    of experiments on a platform: its controllers, and the motion that it plays
legs            the campaigns of a platform, leg by leg, and what is computed on each
fitted_plant        what a report says of a plant that was fitted to a frequency response
limits_told         the limits of a live rig as its pages tell them, whose each is, and what tripped
judged              in words: the delay and the noise that loops were judged with
wire_campaign      recordings of a live rig as a campaign folder
sheet_options, sheet_page    sheets to sign: what is asked, and the page, printed as a PDF
page_server        pages for the browser of this machine: who may ask
shipped            experiments and campaigns that come with jackbench, by name
"""
