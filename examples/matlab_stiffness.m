% cdsm from MATLAB (R2022a or later): tensions, stiffness and a load test of an arm, as MATLAB numbers.
% Once:  pyenv(Version="PATH/TO/.venv/bin/python")   % where `pip install cdsm-stiffness` went
% The first call compiles kernels, once on a machine: `cdsm warm` in a terminal does it before.

arm = py.cdsm.Manipulator.read("examples/arm.toml");
names = string(arm.joint_names);

q = zeros(1, double(arm.nv));
q(names == "joint3_1") = deg2rad(10);
pose = arm.at(q);

tension = py.cdsm.distribute_tension(pose, 10);       % least tension [N]
K = py.cdsm.stiffness(pose, tension);
fprintf("stable: %d, along z: %.3f N/mm\n", K.is_stable, K.along("z") / 1000)

F      = double(tension.values);                      % [N], one per cable
Ktheta = double(K.joint);                             % [N m/rad]
C      = double(K.compliance);                        % 6 x 6, [m/N] in its first three rows and columns
assert(issymmetric(round(Ktheta, 9)))

% all angles of one joint at once: rows of q, compiled and parallel
angles = linspace(-0.3, 0.3, 61).';
rows = zeros(61, double(arm.nv));
rows(:, names == "joint3_1") = angles;
batch = py.cdsm.evaluate(arm, py.numpy.array(rows), minimum=10, outputs={"along"}, direction="z");
plot(rad2deg(angles), double(py.operator.getitem(batch, "along")) / 1000)
xlabel("joint3_1 [deg]"), ylabel("stiffness along z [N/mm]")

% an error names the joint, cable or key that is to blame
try
    arm.at(10 * ones(1, double(arm.nv)));
catch problem
    disp(problem.message)
end
